"""Where a link is round: outlines that planes cut from its mesh, and circles through them.

An outline is how far the mesh reaches in each of `BINS` directions round an axis; what lies
inside it, a tube's bore or the parts of a link that overlap, does not count.
"""

from typing import NamedTuple

import numpy as np
import trimesh

from app.messages import Array
from app.robot.meshes import BodyMesh

BINS = 72  # directions of an outline
SAMPLES = 33  # points on each straight piece of a cut, so that none of its directions is missed
OFF = 0.04  # of the radius: more than the corners of a cylinder with 12 sides stand out
STATIONS = 60  # cuts along a link
STEP = 0.003  # [m] that the middle may move from one cut to the next
TAPER = 0.1  # of the radius that it may change by along a stretch
EVEN = 0.95  # of the longest stretch: this long along an axis of the frame is as good


class Circle(NamedTuple):
    """A round cut: centre (3,) [m], and the largest radius round it [m]."""

    centre: Array
    radius: float


class Stretch(NamedTuple):
    """A round stretch of a link, link frame: its ends (3,) [m], its radius [m] at the widest."""

    low: Array
    high: Array
    radius: float

    @property
    def length(self) -> float:
        """[m] from end to end."""
        return float(np.linalg.norm(self.high - self.low))

    @property
    def axis(self) -> Array:
        """(3,) unit, from the low end to the high one."""
        return np.asarray((self.high - self.low) / self.length)


def across(axis: Array) -> Array:
    """(2, 3) two unit vectors that make a right-handed frame with the unit `axis` (3,)."""
    u = np.eye(3)[int(np.argmin(np.abs(axis)))]
    u = u - (u @ axis) * axis
    u /= np.linalg.norm(u)
    return np.array([u, np.cross(axis, u)])


def outline(body: BodyMesh, centre: Array, axis: Array, within: float = np.inf) -> Array:
    """(BINS,) [m] how far the cut through `centre` reaches from it, NaN where there is nothing.

    within: [m] what is farther away from the axis is not looked at.
    """
    return _reach(_cut(body, centre, axis) @ across(axis).T, within)


def circle(body: BodyMesh, near: Array, axis: Array) -> Circle | None:
    """The circle that the plane through `near` (3,) cuts; None where the cut is not round."""
    basis = across(axis)
    flat = _cut(body, near, axis) @ basis.T
    if not len(flat):
        return None
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2.0
    for _ in range(2):
        reach = _reach(flat - middle, np.inf)
        if np.isnan(reach).any():
            return None
        middle = middle + _centre(reach)
    reach = _reach(flat - middle, np.inf)
    if np.isnan(reach).any() or np.ptp(reach) > OFF * reach.max():
        return None
    return Circle(near + middle @ basis, float(reach.max()))


def round_stretch(body: BodyMesh) -> Stretch | None:
    """The longest round stretch of a mesh, along an axis of its frame or a principal one."""
    used = body.vertices[np.unique(body.faces)]
    principal = np.linalg.eigh(np.cov(used.T))[1].T
    found = [s for axis in np.eye(3) if (s := _along(body, used, axis)) is not None]
    others = [s for axis in principal if (s := _along(body, used, axis)) is not None]
    longest = max((*found, *others), key=lambda s: s.length, default=None)
    if longest is None:
        return None
    return next((s for s in found if s.length >= EVEN * longest.length), longest)


def _along(body: BodyMesh, used: Array, axis: Array) -> Stretch | None:
    """The longest round stretch along a unit axis (3,)."""
    t = used @ axis
    at, step = np.linspace(t.min(), t.max(), STATIONS, endpoint=False, retstep=True)
    middle = used.mean(axis=0)
    runs: list[list[Circle]] = [[]]
    for place in at + step / 2.0:
        cut = circle(body, middle + (place - middle @ axis) * axis, axis)
        if cut is None:
            runs.append([])
        elif runs[-1] and not _goes_on(runs[-1], cut, axis):
            runs.append([cut])
        else:
            runs[-1].append(cut)
    best = max(runs, key=len)
    if not best:
        return None
    centre = np.mean([c.centre - (c.centre @ axis) * axis for c in best], axis=0)
    ends = best[0].centre @ axis - step / 2.0, best[-1].centre @ axis + step / 2.0
    low, high = (centre + end * axis for end in ends)
    return Stretch(low, high, max(c.radius for c in best))


def _goes_on(run: list[Circle], cut: Circle, axis: Array) -> bool:
    moved = cut.centre - run[-1].centre
    aside = np.linalg.norm(moved - (moved @ axis) * axis)
    radii = [c.radius for c in (*run, cut)]
    return bool(aside <= STEP and max(radii) - min(radii) <= TAPER * max(radii))


def _cut(body: BodyMesh, centre: Array, axis: Array) -> Array:
    """(n, 3) [m] points of the cut through a plane, seen from `centre`."""
    mesh = trimesh.Trimesh(body.vertices, body.faces, process=False)
    pieces = trimesh.intersections.mesh_plane(mesh, axis, centre).reshape(-1, 2, 3) - centre
    share = np.linspace(0.0, 1.0, SAMPLES)[:, None, None]
    return np.asarray((pieces[:, 0] + share * (pieces[:, 1] - pieces[:, 0])).reshape(-1, 3))


def _reach(flat: Array, within: float) -> Array:
    """(BINS,) the largest distance of points (n, 2) from the origin in each direction."""
    r = np.hypot(*flat.T)
    turn = np.arctan2(flat[:, 1], flat[:, 0]) / (2.0 * np.pi)
    out = np.full(BINS, -np.inf)
    np.maximum.at(out, np.floor(turn * BINS).astype(int) % BINS, np.where(r <= within, r, -np.inf))
    return np.where(np.isfinite(out), out, np.nan)


def _centre(reach: Array) -> Array:
    """(2,) centre of the circle nearest to an outline: linear least squares (Kasa 1976)."""
    turn = 2.0 * np.pi * (np.arange(BINS) + 0.5) / BINS
    p = reach[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    rows = np.column_stack([2.0 * p, np.ones(BINS)])
    return np.asarray(np.linalg.lstsq(rows, reach**2, rcond=None)[0][:2])
