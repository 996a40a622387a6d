"""The arm's surface as patches of equal area, with the directions from which things come.

Patches are spread by systematic sampling: one in the middle of each of P equal shares of the
whole area, triangle after triangle, at a place in the triangle that a low-discrepancy sequence
gives (Roberts' R2). So a robot has always the same patches.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.robot.model import Robot
from app.robot.roundness import across

COUNT = 5000
RINGS = ((0.0, 1), (35.0, 6), (65.0, 12))  # [deg] off the normal, number; about equal solid angles
PLASTIC = 1.32471795724474602596  # of the sequence
LIFT = 5e-4  # [m] off the surface, where rays from it start


class Patches(NamedTuple):
    """P patches of body links, each in the frame of its link, and M ways to come to each.

    link: (P,).   point: (P, 3) [m].   normal: (P, 3) unit, outwards.   area: (P,) [m^2].
    direction: (P, M, 3) unit, from the patch to where the object comes from, round the normal.
    """

    link: NDArray[np.int64]
    point: Array
    normal: Array
    area: Array
    direction: Array


class Posed(NamedTuple):
    """Patches in the base frame: point (P, 3) [m], normal (P, 3), direction (P, M, 3)."""

    point: Array
    normal: Array
    direction: Array


def patches_of(robot: Robot, count: int = COUNT) -> Patches:
    """About `count` patches of all body links together, at least one of each."""
    corners = [b.vertices[b.faces] for b in robot.bodies]
    areas = [_areas(c) for c in corners]
    whole = float(sum(a.sum() for a in areas))
    link, point, normal, area = [], [], [], []
    for i, (c, a) in enumerate(zip(corners, areas, strict=True)):
        n = max(1, round(count * float(a.sum()) / whole))
        face = np.searchsorted(np.cumsum(a), (np.arange(n) + 0.5) * a.sum() / n)
        face = face.clip(max=len(a) - 1)
        link.append(np.full(n, i, dtype=np.int64))
        point.append(_places(c[face]))
        normal.append(_normals(c[face]))
        area.append(np.full(n, a.sum() / n))
    normals = np.concatenate(normal)
    place, share = np.concatenate(point), np.concatenate(area)
    return Patches(np.concatenate(link), place, normals, share, round_of(normals))


def posed(patches: Patches, T_base_link: Array) -> Posed:
    """The patches where links posed at T_base_link (L, 4, 4) carry them."""
    T = T_base_link[patches.link]
    R = T[:, :3, :3]
    return Posed(
        np.einsum("pij,pj->pi", R, patches.point) + T[:, :3, 3],
        np.einsum("pij,pj->pi", R, patches.normal),
        np.ascontiguousarray(patches.direction @ R.transpose(0, 2, 1)),
    )


def round_of(normals: Array) -> Array:
    """(P, M, 3) unit directions round each of the normals (P, 3), `RINGS` of them."""
    out = []
    for n in normals:
        u, v = across(n)
        for off, count in RINGS:
            turn = 2.0 * np.pi * np.arange(count) / count
            side = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
            out.append(np.cos(np.radians(off)) * n + np.sin(np.radians(off)) * side)
    return np.concatenate(out).reshape(len(normals), -1, 3)


def _areas(corners: Array) -> Array:
    return np.asarray(np.linalg.norm(_crosses(corners), axis=1) / 2.0)


def _normals(corners: Array) -> Array:
    n = _crosses(corners)
    return np.asarray(n / np.linalg.norm(n, axis=1, keepdims=True))


def _crosses(corners: Array) -> Array:
    """(F, 3) of triangles (F, 3, 3), twice their area long."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _places(corners: Array) -> Array:
    """A point (n, 3) in each of the triangles (n, 3, 3), spread evenly over their kind."""
    at = (0.5 + np.arange(1, len(corners) + 1)[:, None] / PLASTIC ** np.array([1.0, 2.0])) % 1.0
    root = np.sqrt(at[:, :1])
    weights = np.hstack((1.0 - root, root * (1.0 - at[:, 1:]), root * at[:, 1:]))
    return np.asarray(np.einsum("nk,nkj->nj", weights, corners))
