"""How sure is a mean of few trials? The percentile bootstrap.

Efron and Tibshirani, "An Introduction to the Bootstrap", 1993, chapter 13: the trials are drawn
again and again, with replacement, and the means of those draws are looked at.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

DRAWS = 10_000


class Interval(NamedTuple):
    """A mean and the limits of its interval."""

    mean: float
    low: float
    high: float


def bootstrap(values: Sequence[float], level: float = 0.95, seed: int = 0) -> Interval:
    """The mean of `values`, with the interval that holds `level` of the means drawn again."""
    x = np.array(values, dtype=np.float64)
    drawn = np.random.default_rng(seed).choice(x, (DRAWS, len(x))).mean(axis=1)
    low, high = np.quantile(drawn, (0.5 - 0.5 * level, 0.5 + 0.5 * level))
    return Interval(float(x.mean()), float(low), float(high))
