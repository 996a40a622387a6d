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
from app.perception.uncertainty import SIGMAS

QUANTILE = 0.9997  # of the self returns that stay within the threshold
LEAST = 200  # returns that a link's suggestion needs
BINS = np.arange(-0.05, 0.0501, 0.005)  # [m] of the histogram


@dataclass(frozen=True, eq=False)
class Suggestion:
    """Thresholds [m] of one link, its returns and their histogram.

    eps, edge: for zones that see only the link and for zones across its edge; NaN: too few
    returns.
    """

    link: str
    eps: float
    edge: float
    returns: int
    histogram: NDArray[np.int64]


def suggest(
    links: tuple[str, ...],
    link: NDArray[np.int16],
    gap: Array,
    noise: Array,
    edge: NDArray[np.bool_],
) -> list[Suggestion]:
    """One suggestion a link from self returns (n,): link hit, gap [m], standard deviation of the
    reported distance [m], across an edge."""
    out = []
    for i, name in enumerate(links):
        mine = link == i
        rest = gap - SIGMAS * noise
        inside, across = (_quantile(rest[mine & which]) for which in (~edge, edge))
        histogram = np.histogram(gap[mine], BINS)[0]
        out.append(Suggestion(name, inside, across, int(mine.sum()), histogram))
    return out


def _quantile(rest: Array) -> float:
    return max(0.0, float(np.quantile(rest, QUANTILE))) if len(rest) >= LEAST else np.nan
