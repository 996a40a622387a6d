"""Points on surfaces, close together."""

import numpy as np
from numpy.typing import NDArray

from app.messages import Array


def surface_points(vertices: Array, faces: NDArray[np.int64], spacing: float) -> Array:
    """(n, 3) [m] samples of a mesh, at most `spacing` [m] apart, its own frame.

    Corners of small triangles and lattices on large ones, of which one a cube of `spacing` stays.
    """
    corners = vertices[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    large = longest > spacing
    lattices = _lattices(corners[large], np.ceil(longest[large] / spacing).astype(np.int64))
    return _thinned(np.concatenate([corners[~large].reshape(-1, 3), lattices]), spacing)


def _lattices(corners: Array, steps: NDArray[np.int64]) -> Array:
    """Points of triangles (t, 3, 3), one triangle after the other, each with its own number (t,)
    of steps along an edge."""
    count = (steps + 1) * (steps + 2) // 2
    first = np.cumsum(count) - count
    points = np.empty((int(count.sum()), 3))
    for n in np.unique(steps):  # those alike in one go: a call for each was most of it
        alike = steps == n
        i, j = np.nonzero(np.add.outer(np.arange(n + 1), np.arange(n + 1)) <= n)
        weights = np.column_stack((i, j, n - i - j)) / n
        points[first[alike, None] + np.arange(len(i))] = weights @ corners[alike]
    return points


def _thinned(points: Array, spacing: float) -> Array:
    """The first of the points that share a cube of `spacing`."""
    cubes: NDArray[np.int64] = np.floor(points / spacing).astype(np.int64)
    cubes -= cubes.min(axis=0)
    _, first = np.unique(np.ravel_multi_index(cubes.T, cubes.max(axis=0) + 1), return_index=True)
    return np.asarray(points[np.sort(first)])
