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
    points = [_lattice(c, e, spacing) for c, e in zip(corners[large], longest[large], strict=True)]
    return _thinned(np.concatenate([corners[~large].reshape(-1, 3), *points]), spacing)


def _lattice(corners: Array, longest: float, spacing: float) -> Array:
    """Points of a triangle (3, 3), `spacing` apart along its longest edge."""
    n = int(np.ceil(longest / spacing))
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    inside = i + j <= n
    weights = np.column_stack((i[inside], j[inside], n - i[inside] - j[inside])) / n
    return np.asarray(weights @ corners)


def _thinned(points: Array, spacing: float) -> Array:
    """One of the points that share a cube of `spacing`."""
    cubes: NDArray[np.int64] = np.floor(points / spacing).astype(np.int64)
    _, first = np.unique(cubes, axis=0, return_index=True)
    return np.asarray(points[np.sort(first)])
