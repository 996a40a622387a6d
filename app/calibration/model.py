"""What a zone reports of a plane, and how that changes with all that is estimated.

A zone looks along u (unit depth, sensor frame) from the lens o, turned by R into the base frame;
the plane is n . x = h. Depth along the axis, where the zone's middle meets the plane at x:

    d = (h - n . o) / (n . R u)

A small displacement e of the sensor's side, or f of the plane's, at x changes it by

    dd = n . (f - e) / (n . R u)                                                            (1)

which gives every column but two: a shift s of the lens, a turn w (both in the sensor's frame),
the errors of the joints' frames before the sensor and the target, how late the stamps are (the arm
moves by v dt) and how a plane lies. A zone is no ray: over it the depth spreads by d rho,

    rho^2 = ((h_x n_x)^2 + (h_y n_y)^2) / (3 (n . u)^2)      h: half width in x and y, unit depth

and the pulse of a slanted plane is reported somewhat before its middle. By how much depends on the
sensor's firmware, so it is estimated too, as two numbers of the whole skin, `lead` and `curve`:

    report = (1 + b) d (1 - lead rho - curve rho^2) + near offset(d) - glare k(d)

times |u| if radial; b is the zone's own share. A dirty window sends light back too, and draws what
is near towards it: the more, the weaker the target's light, which falls with d^2, until the two are
too far apart to be one pulse. Of a sensor with a clean window glare is 0.

    k(d) = d (d / D)^2 exp(-(d / D)^2)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.calibration.sight import FIRST_LINK
from app.messages import Array

POSE = 6  # unknowns of a sensor: shift along x, y, z [m], turn about x, y, z [rad], and its glare
GLARE = 0.2  # [m] D: crosstalk shows below 0.6 m (UM3109), where k is nothing any more
LATE, LEAD, CURVE, PLANES = 0, 1, 2, 3  # columns of what all share; then 3 a plane, 6 a joint
STEEPEST = 0.35  # |n . u| / |u|: a surface seen at more of a slant is left out


@dataclass(frozen=True, eq=False, slots=True)
class Rows:
    """N reports of planes, base frame.

    sensor, zone, view: (N,).   target: (N,), see `app.calibration.sight`.
    u:      (N, 3) where the zone looks, unit depth, sensor frame.   half: (N, 2) its half width.
    length: (N,) |u| of a radial sensor, else 1.
    normal: (N, 3), height: (N,) [m] of the plane.   bent: (N,) [m] how far it is none.
    report: (N,) [m] mean of `frames` (N,) reports.
    """

    sensor: NDArray[np.intp]
    zone: NDArray[np.intp]
    view: NDArray[np.intp]
    target: NDArray[np.int32]
    u: Array
    half: Array
    length: Array
    normal: Array
    height: Array
    bent: Array
    report: Array
    frames: Array


@dataclass(frozen=True, eq=False, slots=True)
class Placed:
    """Where everything is in each of V views, base frame.

    T_base_sensor: (V, 4, 4).   T_base_joint: (V, n, 4, 4).   twist: (V, 6, n) columns of the
    spatial Jacobian times the joints' velocities: how joint j moves what it carries.
    carries: (L, n) 1 where joint j moves link l.   link: (V,) of the sensor.
    """

    T_base_sensor: Array
    T_base_joint: Array
    twist: Array
    carries: Array
    link: NDArray[np.intp]


@dataclass(frozen=True, eq=False, slots=True)
class Predicted:
    """(N,) reports [m], and by what they change.

    depth: (N,) [m].   slant: (N,) cosine between ray and normal.   spread: (N,) [m] d rho.
    pose: (N, 7).   zone: (N,) per share of that zone.   shared: (N, G).
    """

    report: Array
    depth: Array
    slant: Array
    spread: Array
    pose: Array
    zone: Array
    shared: Array


def predict(
    rows: Rows, placed: Placed, share: Array, shared: Array, T_plane: Array, near: Array,
    glare: Array,
) -> Predicted:  # fmt: skip
    """What the zones should report.

    share: (N,) of each row's zone.   shared: (G,) values of which lead and curve are read; what the
    others change is in `placed` and `rows` already.   near: (N, 2) the type's near offset [m] and
    up to where.   glare: (N,) of each row's sensor.
    """
    T = placed.T_base_sensor[rows.view]
    n = rows.normal
    n_s = np.einsum("nji,nj->ni", T[:, :3, :3], n)  # sensor frame
    along = (n_s * rows.u).sum(axis=1)
    lens = T[:, :3, 3]
    d = (rows.height - (n * lens).sum(axis=1)) / along
    a = n_s[:, :2] / along[:, None]
    rho = np.sqrt(np.maximum(((rows.half * a) ** 2).sum(axis=1) / 3, 1e-12))
    lead, curve = shared[LEAD], shared[CURVE]
    early = 1.0 - lead * rho - curve * rho**2
    gain = (1.0 + share) * rows.length
    offset, slope = _near(d, near)
    drawn, drawn_slope = drawn_near(d)
    dm_dd = gain * early + rows.length * (slope - glare * drawn_slope)
    turn = np.cross(rows.u, n_s)
    pose = np.concatenate((-n_s, -d[:, None] * turn), axis=1) * (dm_dd / along)[:, None]
    dm_drho = -gain * d * (lead + 2 * curve * rho)
    pose[:, 3:] += dm_drho[:, None] * _spread_turned(rows.half, a, rho, n_s, turn, along)
    out = np.zeros((len(d), len(shared)))
    out[:, LEAD], out[:, CURVE] = -gain * d * rho, -gain * d * rho**2
    x = lens + d[:, None] * np.einsum("nij,nj->ni", T[:, :3, :3], rows.u)
    _shared_columns(out, rows, placed, T_plane, x, dm_dd / along)
    return Predicted(
        report=gain * d * early + rows.length * (offset - glare * drawn),
        depth=d,
        slant=-along / np.linalg.norm(rows.u, axis=1),
        spread=d * rho,
        pose=np.concatenate((pose, -(rows.length * drawn)[:, None]), axis=1),
        zone=rows.length * d * early,
        shared=out,
    )


def drawn_near(d: Array) -> tuple[Array, Array]:
    """k(d) (N,) [m] and how it changes with the depth."""
    square = (d / GLARE) ** 2
    fall = square * np.exp(-square)
    return d * fall, fall * (3.0 - 2.0 * square)


def _near(d: Array, near: Array) -> tuple[Array, Array]:
    """The offset near the lens (N,) [m] and how it changes with the depth."""
    inside = d < near[:, 1]
    slope = np.where(inside, -near[:, 0] / near[:, 1], 0.0)
    return np.where(inside, near[:, 0] * (1.0 - d / near[:, 1]), 0.0), slope


def _spread_turned(half: Array, a: Array, rho: Array, n: Array, turn: Array, along: Array) -> Array:
    """(N, 3) how rho changes with a turn of the sensor.

    With a_i = n_i / (n . u) and n turned to n + n x w:  da_i = ((e_i x n) - a_i (u x n)) . w / n.u
    """
    zero = np.zeros(len(n))
    e_x = np.stack((zero, -n[:, 2], n[:, 1]), axis=1)
    e_y = np.stack((n[:, 2], zero, -n[:, 0]), axis=1)
    out = np.zeros((len(n), 3))
    for i, e in enumerate((e_x, e_y)):
        da = (e - a[:, i, None] * turn) / along[:, None]
        out += (half[:, i] ** 2 * a[:, i] / (3 * rho))[:, None] * da
    return out


def _shared_columns(
    out: Array, rows: Rows, placed: Placed, T_plane: Array, x: Array, per: Array
) -> None:
    """Write the columns of time, planes and joints by (1); per: (N,) dm/dd over n . R u."""
    n, view = rows.normal, rows.view
    link = np.where(rows.target <= FIRST_LINK, FIRST_LINK - rows.target, 0)
    on_link = (rows.target <= FIRST_LINK)[:, None]
    mine = placed.carries[placed.link[view]]
    relative = mine - np.where(on_link, placed.carries[link], 0.0)  # (N, n)
    moved = placed.twist[view]  # (N, 6, n)
    n_x = np.cross(x, n)  # n . (w x x) = w . (x x n)
    speed = np.einsum("ni,nij->nj", n, moved[:, :3]) + np.einsum("ni,nij->nj", n_x, moved[:, 3:])
    out[:, LATE] = per * (relative * speed).sum(axis=1)
    P = len(T_plane)
    for p in range(P):
        mine_p = np.flatnonzero(rows.target == p)
        at = (x[mine_p] - T_plane[p, :3, 3]) @ T_plane[p, :3, :2]
        columns = np.stack((np.ones(len(mine_p)), at[:, 1], -at[:, 0]), axis=1)
        out[mine_p, PLANES + 3 * p : PLANES + 3 * p + 3] = per[mine_p, None] * columns
    first = PLANES + 3 * P
    for j in range(placed.T_base_joint.shape[1]):
        T = placed.T_base_joint[view, j]
        n_j = np.einsum("nji,nj->ni", T[:, :3, :3], n)
        x_j = np.einsum("nji,nj->ni", T[:, :3, :3], x - T[:, :3, 3])
        column = np.concatenate((n_j, np.cross(x_j, n_j)), axis=1)
        out[:, first + 6 * j : first + 6 * j + 6] = -(per * relative[:, j])[:, None] * column
