"""The points in use, gathered coordinate by coordinate, and how far they are from a link's box.

Thousands of points are tested against every link. Coordinate by coordinate the compiler makes
vector instructions of that: about a nanosecond a point.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.tree import Forest


class Gathered(NamedTuple):
    """m points [m], base frame, and the row (m,) of each among all points."""

    row: NDArray[np.int64]
    x: Array
    y: Array
    z: Array


@compiled
def gather(points: Array, use: NDArray[np.bool_]) -> Gathered:
    """The used ones of points (n, 3); those with NaN are left out."""
    n, m = len(points), 0
    row, x, y, z = np.empty(n, dtype=np.int64), np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        if use[i] and np.isfinite(points[i, 0] + points[i, 1] + points[i, 2]):
            row[m], x[m], y[m], z[m] = i, points[i, 0], points[i, 1], points[i, 2]
            m += 1
    return Gathered(row[:m], x[:m], y[:m], z[:m])


@compiled
def box_squares(who: Gathered, T: Array, link: int, forest: Forest, square: Array) -> None:
    """Write the squared distances (m,) [m^2] to the box of a link posed at T, 0 inside."""
    a, b, c, low = T[0, :3], T[1, :3], T[2, :3], forest.low[link]
    high, tx, ty, tz = forest.high[link], T[0, 3], T[1, 3], T[2, 3]
    for i in range(len(who.x)):
        x, y, z = who.x[i] - tx, who.y[i] - ty, who.z[i] - tz
        u, v, w = (
            a[0] * x + b[0] * y + c[0] * z,
            a[1] * x + b[1] * y + c[1] * z,
            a[2] * x + b[2] * y + c[2] * z,
        )
        u, v, w = (
            max(max(low[0] - u, u - high[0]), 0.0),
            max(max(low[1] - v, v - high[1]), 0.0),
            max(max(low[2] - w, w - high[2]), 0.0),
        )
        square[i] = u * u + v * v + w * w
