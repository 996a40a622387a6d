"""Thresholds of the self filter from recorded returns of the robot's own body.

Move the arm through its poses with nothing near it: whatever the sensors see at the body's
depth is the body. The threshold of a link is what nearly all of its returns lie before it by
at most, after the noise that grows with range has been taken off. Returns from behind the
body are impossible and thrown away whatever the threshold, so they do not count.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.robot.skin import range_noise

QUANTILE = 0.999  # of the self returns that stay within the threshold
LEAST = 200  # returns that a link's suggestion needs
BINS = np.arange(-0.05, 0.0501, 0.005)  # [m] of the histogram


@dataclass(frozen=True, eq=False)
class Suggestion:
    """Threshold base [m] of one link (NaN: too few returns), its returns and their histogram."""

    link: str
    eps: float
    returns: int
    histogram: NDArray[np.int64]


def suggest(
    links: tuple[str, ...], link: NDArray[np.int16], gap: Array, depth: Array, sigmas: float
) -> list[Suggestion]:
    """One suggestion a link from self returns (n,): link hit, gap [m] and depth [m]."""
    out = []
    for i, name in enumerate(links):
        mine = link == i
        rest = gap[mine] - sigmas * range_noise(depth[mine])
        enough = len(rest) >= LEAST
        eps = max(0.0, float(np.quantile(rest, QUANTILE))) if enough else np.nan
        histogram = np.histogram(gap[mine], BINS)[0]
        out.append(Suggestion(name, eps, int(mine.sum()), histogram))
    return out
