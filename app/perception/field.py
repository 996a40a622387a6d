"""A coarse table of signed distances around each link: what most points never get past.

A signed distance changes by no more than one moves. So the value at the middle of a point's
cell, give or take how far the point lies from there, bounds its distance from both sides.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, freeze
from app.perception.nearest import nearest_face
from app.perception.tree import Forest, plant
from app.robot.meshes import BodyMesh

AROUND = 0.25  # [m] around a link's box in which distances are tabulated
CELLS = 24  # along each edge of the table
ROUNDING = 1e-6  # [m] the table is float32


def surveyed(bodies: Sequence[BodyMesh]) -> tuple[Forest, NDArray[np.float32]]:
    """The trees of `bodies` and (L, CELLS**3) [m] their signed distance, read-only.

    Of the distances those at the middle of every cell, z fastest.
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
    out = np.empty((len(forest.root), CELLS**3), dtype=np.float32)
    _fill(forest, out)
    for array in forest:
        freeze(array)
    return forest, freeze(out)


@compiled
def _fill(forest: Forest, out: NDArray[np.float32]) -> None:
    p, found = np.empty(3), np.empty(3)
    for link in range(len(out)):
        low = forest.low[link] - AROUND
        size = (forest.high[link] + AROUND - low) / CELLS
        for x in range(CELLS):
            for y in range(CELLS):
                limit = np.inf
                for z in range(CELLS):
                    p[0] = low[0] + (x + 0.5) * size[0]
                    p[1] = low[1] + (y + 0.5) * size[1]
                    p[2] = low[2] + (z + 0.5) * size[2]
                    d2, face, part = nearest_face(p, limit, link, forest, found)
                    d = np.sqrt(d2)
                    side = 0.0
                    for a in range(3):
                        side += (p[a] - found[a]) * forest.normals[face, part, a]
                    out[link, (x * CELLS + y) * CELLS + z] = (
                        -d if side < 0.0 and forest.closed[link] else d
                    )
                    # the next cell's middle is no farther from the surface than this
                    limit = (d + size[2]) ** 2 * 1.001 + 1e-9


@compiled
def bounds(p: Array, link: int, forest: Forest, field: NDArray[np.float32]) -> tuple[float, float]:
    """Lower and upper bound [m] of the signed distance of p (3,) [link frame]; loose ones
    outside the table, from its nearest cell.
    """
    shift = 0.0
    row = 0
    for a in range(3):
        low = forest.low[link, a] - AROUND
        size = (forest.high[link, a] + AROUND - low) / CELLS
        at = (p[a] - low) / size
        cell = int(min(max(at, 0.0), CELLS - 1.0))
        shift += ((at - cell - 0.5) * size) ** 2
        row = row * CELLS + cell
    d, r = field[link, row], np.sqrt(shift) + ROUNDING
    return d - r, d + r
