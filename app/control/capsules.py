"""Capsules around the bodies of a robot, fitted to its meshes; any robot, nothing by hand.

A capsule is a segment with a radius. One around a bent link would be fat, so a link's mesh is
cut across where two capsules hold it in clearly less volume, at most into `MOST` pieces.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from trimesh.remesh import subdivide_to_size

from app.messages import Array, freeze
from app.robot.meshes import BodyMesh

MOST = 3  # capsules of one link
GAIN = 0.85  # a cut is worth it below this share of the volume
CUTS = (0.15, 0.3, 0.5, 0.7, 0.85)  # where cuts are tried, shares of the length
FINEST = 150  # steps along the largest body: one of 1 km would have more points than memory
SPACING = 0.02  # [m] of the points on the surface; both sides of a cut get those this near


@dataclass(frozen=True, eq=False, slots=True)
class Capsules:
    """C capsules in link frames: a, b (C, 3) ends [m], radius (C,) [m], link (C,)."""

    a: Array
    b: Array
    radius: Array
    link: NDArray[np.intp]


@dataclass(frozen=True, eq=False, slots=True)
class _Fit:
    a: Array
    b: Array
    radius: float
    points: Array  # (n, 3) that it holds

    @property
    def volume(self) -> float:
        length = float(np.linalg.norm(self.b - self.a))
        return float(np.pi * self.radius**2 * (length + 4.0 / 3.0 * self.radius))


def fit_capsules(bodies: Sequence[BodyMesh]) -> Capsules:
    """Capsules that hold every vertex of every body."""
    fits = [
        (i, f)
        for i, body in enumerate(bodies)
        for f in _of_body(body.vertices.tobytes(), body.faces.tobytes())
    ]
    return Capsules(
        a=freeze(np.array([f.a for _, f in fits])),
        b=freeze(np.array([f.b for _, f in fits])),
        radius=freeze(np.array([f.radius for _, f in fits])),
        link=freeze(np.array([i for i, _ in fits], dtype=np.intp)),
    )


@lru_cache(maxsize=64)
def _of_body(vertices: bytes, faces: bytes) -> list[_Fit]:
    """Of one mesh, by its content: a fit costs a tenth of a second and robots are read often."""
    corners = np.frombuffer(vertices).reshape(-1, 3)
    triangles = np.frombuffer(faces, dtype=np.int64).reshape(-1, 3)
    used = corners[triangles].reshape(-1, 3)
    spacing = max(SPACING, float(np.ptp(used, axis=0).max()) / FINEST)
    points, _ = subdivide_to_size(corners, triangles, spacing, max_iter=12)
    pieces = [_fit(np.unique(points, axis=0))]
    cuts = [_cut(pieces[0], spacing)]
    while len(pieces) < MOST:
        total = sum(p.volume for p in pieces)
        saved = [p.volume - sum(c.volume for c in cut) for p, cut in zip(pieces, cuts, strict=True)]
        i = int(np.argmax(saved))
        if saved[i] < (1.0 - GAIN) * total:
            break
        new = cuts[i]
        pieces[i : i + 1], cuts[i : i + 1] = new, [_cut(p, spacing) for p in new]
    return pieces


def _cut(piece: _Fit, spacing: float) -> list[_Fit]:
    """The best two capsules of a piece, cut across its longest extent; spacing: of its points."""
    points = piece.points
    t = points @ _axes(points)[0]
    low, high = t.min(), t.max()
    best: list[_Fit] = [piece]
    for share in CUTS:
        at = low + share * (high - low)
        sides = points[t <= at + spacing], points[t >= at - spacing]
        if min(map(len, sides)) < 8:
            continue
        two = [_fit(side) for side in sides]
        if sum(f.volume for f in two) < sum(f.volume for f in best):
            best = two
    return best


def _fit(points: Array) -> _Fit:
    """The smallest of the capsules along a few axes: what holds the hull holds the points."""
    corners = points[ConvexHull(points, qhull_options="QJ").vertices]
    fits = [_along(corners, axis) for axis in _axes(points)]
    return min((_Fit(a, b, r, points) for a, b, r in fits), key=lambda f: f.volume)


def _axes(points: Array) -> Array:
    """Principal axes of the points, the longest first, and the axes of their frame, (6, 3)."""
    spread, principal = np.linalg.eigh(np.cov(points.T))
    return np.concatenate((principal.T[np.argsort(-spread)], np.eye(3)))


def _along(points: Array, axis: Array) -> tuple[Array, Array, float]:
    """The shortest capsule of the least radius with this axis that holds the points."""
    basis = np.linalg.svd(axis[None])[2]
    flat, t = points @ basis[1:].T, points @ axis
    centre, r = _circle(flat)
    aside = np.square(flat - centre).sum(axis=1)
    cap = np.sqrt(np.maximum(r * r - aside, 0.0))
    low, high = float((t + cap).min()), float((t - cap).max())
    if low > high:  # one ball will do
        low = high = 0.5 * (low + high)
        r = float(np.sqrt((aside + np.square(t - low)).max()))
    foot = centre @ basis[1:]
    return foot + low * axis, foot + high * axis, r


def _circle(points: Array) -> tuple[Array, float]:
    """Centre and radius of a circle hardly larger than the smallest around points (n, 2).

    Steps towards the farthest point that shrink as 1/k (Badoiu and Clarkson 2003).
    """
    centre = points.mean(axis=0)
    for k in range(1, 60):
        away = np.square(points - centre).sum(axis=1)
        centre = centre + (points[int(np.argmax(away))] - centre) / (k + 1)
    return centre, float(np.sqrt(np.square(points - centre).sum(axis=1).max()))
