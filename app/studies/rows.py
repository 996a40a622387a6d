"""Trials of one condition as a row of a table."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from app.studies.bootstrap import bootstrap
from app.studies.trial import TrialResult

SUMMED = frozenset({"contacts", "stops", "own_contacts"})
WORST = frozenset({"true_least_m", "cell_least_m"})  # is the smallest
MOST = frozenset({"own_mps"})
TEXTS = frozenset({"nearest_link", "reactions"})  # no numbers, or none of which there is a mean


def grouped(trials: Iterable[TrialResult]) -> dict[str, list[TrialResult]]:
    """By condition, in the order of the first of each, each in the order of the seeds."""
    out: dict[str, list[TrialResult]] = {}
    for t in trials:
        out.setdefault(t.condition, []).append(t)
    return {name: sorted(of, key=lambda t: t.seed) for name, of in out.items()}


def row_of(
    name: str, trials: Sequence[TrialResult], first: Sequence[str] = (), left_out: str = ""
) -> dict[str, Any]:
    """All figures of a condition, whether sums, worst or means of its trials.

    first: those that come first and with the interval of their mean, as KEY_low and KEY_high.
    left_out: endings of figures that are told otherwise, separated by spaces.
    """
    figures = [t.figures for t in trials]
    row: dict[str, Any] = {"name": name, "trials": len(trials)}
    for key in first:
        known = _finite([f[key] for f in figures])
        if known:
            row[key], row[f"{key}_low"], row[f"{key}_high"] = bootstrap(known)
    endings = tuple(left_out.split())
    for key, value in figures[0].items():
        if key in TEXTS or key in first or isinstance(value, str | dict | list):
            continue
        if endings and key.endswith(endings):
            continue
        known = _finite([f[key] for f in figures])
        if key in SUMMED:
            row[key] = int(sum(known))
        elif known:
            row[key] = _one(key, known)
    return row


def _one(key: str, known: Sequence[float]) -> float:
    if key in WORST:
        return min(known)
    return max(known) if key in MOST else float(np.mean(known))


def _finite(values: Sequence[Any]) -> list[float]:
    x = np.array(values, dtype=np.float64)
    return [float(v) for v in x[np.isfinite(x)]]
