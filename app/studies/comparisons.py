"""Which conditions of a study are compared with each other, from their names alone.

The whole body with the sensors' mounts, the programme with the whole body, the oracle with the
programme, which is the gap that perception leaves; and whatever is changed with the same unchanged.
"""

import re
from collections.abc import Sequence
from typing import Any

from app.studies.paired import difference_row
from app.studies.trial import TrialResult

BESIDE = (("WB", "S"), ("QP", "WB"), ("oracle", "QP"))


def compared(conditions: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs (a, b) of which a - b is told, in the order of their first."""
    names, found = set(conditions), []
    for name in dict.fromkeys(conditions):
        for who, other in BESIDE:
            if name.startswith(who) and (beside := other + name[len(who) :]) in names:
                found.append((name, beside))
        controller, at, variant = name.partition("@")
        plain = re.split("[+-]", controller)[0] + at + variant
        if plain != name and plain in names:
            found.append((name, plain))
    return found


def comparison_rows(trials: Sequence[TrialResult], keys: Sequence[str]) -> list[dict[str, Any]]:
    """A row for each pair and figure that some seed of both has."""
    pairs = compared([t.condition for t in trials])
    rows = [difference_row(trials, a, b, key) for a, b in pairs for key in keys]
    return [row for row in rows if row["n"]]
