"""Which bodies the rays of a cone may reach: the compiled part of a cast."""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array


@compiled
def reached(
    origins: Array,
    apex: Array,
    axis: Array,
    half_angle: float,
    far: float,
    centres: Array,
    radii: Array,
) -> NDArray[np.bool_]:
    """Whose bounding sphere, centres (B, 3) and radii (B,) [m], reaches into the cone, (B,).

    The distance of a point to the half space that touches the cone beside it is a lower
    bound of its distance to the cone. The other arguments are as in `World.cast`.
    """
    start = 0.0
    for n in range(len(origins)):
        square = 0.0
        for i in range(3):
            square += (origins[n, i] - apex[i]) ** 2
        start = max(start, square)
    start = np.sqrt(start)
    cosine, sine = np.cos(half_angle), np.sin(half_angle)
    out = np.empty(len(centres), dtype=np.bool_)
    for b in range(len(centres)):
        square = along = 0.0
        for i in range(3):
            v = centres[b, i] - apex[i]
            square += v * v
            along += v * axis[i]
        aside, r = np.sqrt(max(square - along * along, 0.0)), radii[b]
        beside = aside * cosine - along * sine <= r
        out[b] = beside and along >= -r and np.sqrt(square) <= start + far + r
    return out
