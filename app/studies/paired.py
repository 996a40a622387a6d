"""Two conditions compared seed by seed: how much they differ, how sure that is, and by chance?

The same seed gives both the same sensors and the same world, so that their difference in each seed
says more than the difference of their means. p is that of the two-sided signed-rank test of
Wilcoxon, "Individual comparisons by ranking methods", Biometrics Bulletin 1, 1945: how likely
ranks so one-sided were if neither condition were better. Few seeds cannot be convincing: the least
p that n seeds can have is 2^(1 - n), 0.06 of five.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import wilcoxon

from app.studies.bootstrap import bootstrap
from app.studies.trial import TrialResult


class Paired(NamedTuple):
    """Mean of a - b with the limits of its 95 % interval; p of no difference; n seeds of both."""

    mean: float
    low: float
    high: float
    p: float
    n: int


def paired(a: Mapping[Any, float], b: Mapping[Any, float]) -> Paired:
    """a - b over the seeds, or whatever they are told by, at which both are finite; NaN without
    any."""
    d = np.array([a[seed] - b[seed] for seed in sorted(a.keys() & b.keys())], dtype=np.float64)
    d = d[np.isfinite(d)]
    if not len(d):
        return Paired(np.nan, np.nan, np.nan, np.nan, 0)
    p = float(wilcoxon(d).pvalue) if d.any() else 1.0  # the same in every seed
    return Paired(*bootstrap(d.tolist()), p, len(d))


def by_seed(trials: Sequence[TrialResult], condition: str, key: str) -> dict[int, float]:
    """A figure of a condition's trials."""
    return {t.seed: float(t.figures[key]) for t in trials if t.condition == condition}


def difference(trials: Sequence[TrialResult], a: str, b: str, key: str) -> Paired:
    """`paired` of two conditions' figure among all trials of a study."""
    return paired(by_seed(trials, a, key), by_seed(trials, b, key))


def difference_row(trials: Sequence[TrialResult], a: str, b: str, key: str) -> dict[str, Any]:
    """The same as a row of a table."""
    return {"name": f"{a} - {b}, {key}", **difference(trials, a, b, key)._asdict()}
