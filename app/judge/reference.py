"""Slow and plain answers in float64 to judge the fast ones by; they share no code with them."""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array


@compiled
def first_hit(origin: Array, direction: Array, triangles: Array, near: float) -> float:
    """Distance along a ray to the first of `triangles` (F, 3, 3) beyond `near`, or +inf.

    Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
    """
    best = np.inf
    for f in range(len(triangles)):
        a = triangles[f, 0]
        e, g, s = triangles[f, 1] - a, triangles[f, 2] - a, origin - a
        h = np.cross(direction, g)
        det = e @ h
        if det == 0.0:
            continue
        u = (s @ h) / det
        q = np.cross(s, e)
        v = (direction @ q) / det
        t = (g @ q) / det
        if u >= 0.0 and v >= 0.0 and u + v <= 1.0 and near < t < best:
            best = t
    return best


@compiled
def signed_distance(point: Array, triangles: Array) -> float:
    """Distance to closed `triangles` (F, 3, 3), negative inside by the winding number."""
    best, winding = np.inf, 0.0
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        normal = np.cross(b - a, c - a)
        area2 = normal @ normal
        height = (point - a) @ normal
        foot = point - normal * (height / area2) if area2 > 0.0 else point
        inside = area2 > 0.0
        for i in range(3):
            s, e = triangles[f, i], triangles[f, (i + 1) % 3]
            edge = e - s
            inside &= np.cross(edge, foot - s) @ normal >= 0.0
            length2 = edge @ edge
            t = 0.0 if length2 == 0.0 else min(1.0, max(0.0, ((point - s) @ edge) / length2))
            off = point - s - t * edge
            best = min(best, off @ off)
        if inside:
            best = min(best, height * height / area2)
        a, b, c = a - point, b - point, c - point
        la, lb, lc = np.sqrt(a @ a), np.sqrt(b @ b), np.sqrt(c @ c)
        down = la * lb * lc + (a @ b) * lc + (b @ c) * la + (c @ a) * lb
        winding += np.arctan2(a @ np.cross(b, c), down)
    distance = float(np.sqrt(best))
    return -distance if winding > np.pi else distance


@compiled
def nearest_of(points: Array, triangles: Array) -> float:
    """Smallest signed distance of `points` (n, 3), NaN rows left out; +inf without any."""
    best = np.inf
    for i in range(len(points)):
        if np.isfinite(points[i]).all():
            best = min(best, signed_distance(points[i], triangles))
    return best


def triangles_of(vertices: Array, faces: NDArray[np.int64], T: Array) -> Array:
    """(F, 3, 3) posed at T (4, 4)."""
    return np.ascontiguousarray((vertices @ T[:3, :3].T + T[:3, 3])[faces])
