"""A coarse table of distances around each link: what most points never get past.

The squared distance to a set, d(p)^2 = min |p - q|^2 over its points q, is |p|^2 less a maximum
of linear functions of p. So d^2 - |p|^2 is concave, and inside a cell of a grid no less than
what the cell's corners make of it by interpolation. That of |p|^2 itself is too large by
t (1 - t) h^2 along each edge h, t in 0..1 being the place along it, hence

    d(p)^2  >=  interpolated d^2  -  sum of t (1 - t) h^2 over the three edges

which falls short by millimetres where cells are centimetres. What lies beyond a controller's
reach has a table of its own, as far as the sensors see and coarser.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, freeze
from app.perception.nearest import batch, nearest_faces
from app.perception.tree import Forest, plant
from app.robot.meshes import BodyMesh

AROUND = np.array([0.6, 3.0])  # [m] around a link's box that a near and a far table reach
CELLS = 24  # along each edge of a table
ROUNDING = 4e-6  # [m^2] the table is float32


def surveyed(bodies: Sequence[BodyMesh]) -> tuple[Forest, NDArray[np.float32]]:
    """The trees of `bodies` and (L, 2, (CELLS + 1)**3) [m^2] squares of the distances from them,
    read-only: at the corners of all cells of both tables, z fastest.
    """
    return _surveyed(tuple((b.vertices.tobytes(), b.faces.tobytes()) for b in bodies))


@lru_cache(maxsize=8)
def _surveyed(meshes: tuple[tuple[bytes, bytes], ...]) -> tuple[Forest, NDArray[np.float32]]:
    """By the meshes' content: it costs half a second, and a robot has several pipelines."""
    forest = plant(
        [
            BodyMesh(
                np.frombuffer(v).reshape(-1, 3), np.frombuffer(f, dtype=np.int64).reshape(-1, 3)
            )
            for v, f in meshes
        ]
    )
    out = np.empty((len(forest.root), len(AROUND), (CELLS + 1) ** 3), dtype=np.float32)
    _fill(forest, out)
    for array in forest:
        freeze(array)
    return forest, freeze(out)


@compiled
def _fill(forest: Forest, out: NDArray[np.float32]) -> None:
    asked, line = batch(CELLS + 1), CELLS + 1
    for link in range(len(out)):
        for table in range(len(AROUND)):
            low = forest.low[link] - AROUND[table]
            size = (forest.high[link] + AROUND[table] - low) / CELLS
            for row in range(line * line):
                for z in range(line):
                    p = asked.p[z]
                    p[0], p[1], p[2] = row // line * size[0], row % line * size[1], z * size[2]
                    p += low
                    asked.square[z] = np.inf
                nearest_faces(asked, link, forest)
                out[link, table, row * line : (row + 1) * line] = asked.square


@compiled
def least_square(p: Array, link: int, forest: Forest, field: NDArray[np.float32]) -> float:
    """Lower bound [m^2] of the squared distance from p (3,) [link frame]; 0 beyond the tables."""
    for table in range(len(AROUND)):
        square = _least(p, link, forest, AROUND[table], field[link, table])
        if square >= 0.0:
            return square
    return 0.0


@compiled
def _least(p: Array, link: int, forest: Forest, around: float, d: NDArray[np.float32]) -> float:
    """By one table d; -1 beyond it."""
    row, spare = 0, ROUNDING
    tx, ty, tz = 0.0, 0.0, 0.0
    for a in range(3):
        low = forest.low[link, a] - around
        size = (forest.high[link, a] + around - low) / CELLS
        at = (p[a] - low) / size
        if not 0.0 <= at < CELLS:
            return -1.0
        cell = int(at)
        tx, ty, tz = ty, tz, at - cell  # the last three are x, y, z
        row = row * (CELLS + 1) + cell
        spare += (at - cell) * (1.0 - (at - cell)) * size * size
    y = CELLS + 1
    x = y * y
    near = (1.0 - ty) * _between(d, row, tz) + ty * _between(d, row + y, tz)
    far = (1.0 - ty) * _between(d, row + x, tz) + ty * _between(d, row + x + y, tz)
    return max((1.0 - tx) * near + tx * far - spare, 0.0)


@compiled
def _between(d: NDArray[np.float32], row: int, t: float) -> float:
    return float((1.0 - t) * d[row] + t * d[row + 1])
