"""Where the arm was in each view, given how late the stamps are and how far its joints' frames are
off, and the rows of what its sensors saw from there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.calibration.model import PLANES, Placed, Rows
from app.calibration.sight import NOTHING, Surroundings
from app.calibration.views import Path, Views
from app.messages import Array
from app.robot.model import Robot
from app.robot.posture import Posture, rotation_matrix
from app.robot.skin import Skin, zone_centres


@dataclass(frozen=True, eq=False, slots=True)
class Stance:
    """The arm in each of V views: its postures and T_base_link (V, L, 4, 4), T_base_joint
    (V, n, 4, 4) and twist (V, 6, n), see `app.calibration.model.Placed`."""

    postures: tuple[Posture, ...]
    T_base_link: Array
    T_base_joint: Array
    twist: Array


def stance_of(robot: Robot, views: Views, path: Path, late: float, joint_error: Array) -> Stance:
    """late: [s] of the stamps.   joint_error: (n, 6) [m, rad] of each joint's frame, in it."""
    q = np.where(views.moving[:, None], path.at(views.stamp - late), views.q)
    qd = np.where(views.moving[:, None], path.speed(views.stamp - late), 0.0)
    first = [_first_link(robot, j) for j in range(robot.n)]
    T_link_joint = np.linalg.inv(robot.T_joint_link[first])
    postures, known = [], {}
    for row in q:
        key = row.tobytes()
        if key not in known:
            known[key] = robot.posture(row)
        postures.append(known[key])
    T_base_link = np.array([p.T_base_link for p in postures])
    T_base_joint = T_base_link[:, first] @ T_link_joint
    J = np.array([p.J_base for p in postures])
    return Stance(
        tuple(postures),
        _displaced(T_base_link, T_base_joint, robot.supports, joint_error),
        T_base_joint,
        J * qd[:, None, :],
    )


def _first_link(robot: Robot, j: int) -> int:
    """The body link that is the first to move with joint j."""
    carried = np.flatnonzero(robot.supports[:, j])
    return int(carried[np.argmin(robot.supports[carried].sum(axis=1))])


def _displaced(T_base_link: Array, T_base_joint: Array, carries: Array, error: Array) -> Array:
    """T_base_link (V, L, 4, 4) with the joints' frames off by `error` (n, 6), to first order."""
    R, p = T_base_joint[:, :, :3, :3], T_base_joint[:, :, :3, 3]
    omega = np.einsum("vjab,jb->vja", R, error[:, 3:])
    shift = np.einsum("vjab,jb->vja", R, error[:, :3]) - np.cross(omega, p)
    turn_of, shift_of = carries @ omega, carries @ shift  # (V, L, 3)
    out = T_base_link.copy()
    out[..., :3, 3] += shift_of + np.cross(turn_of, T_base_link[..., :3, 3])
    small = np.zeros((*turn_of.shape[:2], 3, 3))
    x, y, z = np.moveaxis(turn_of, 2, 0)
    small[..., 0, 1], small[..., 0, 2], small[..., 1, 2] = -z, y, -x
    small[..., 1, 0], small[..., 2, 0], small[..., 2, 1] = z, -y, x
    out[..., :3, :3] += small @ T_base_link[..., :3, :3]
    return out


def placed_of(
    robot: Robot, skin: Skin, views: Views, stance: Stance, T_link_sensor: Array
) -> Placed:
    """The sensors of all views at T_link_sensor (K, 4, 4)."""
    link = np.asarray(skin.link)[views.sensor]
    at = stance.T_base_link[np.arange(len(link)), link]
    return Placed(
        at @ T_link_sensor[views.sensor], stance.T_base_joint, stance.twist, robot.supports, link
    )


class Zones:
    """What a zone of each sensor is, (K, Z, ...): see `Rows`."""

    def __init__(self, skin: Skin, zones: int) -> None:
        self.u = np.tile([0.0, 0.0, 1.0], (skin.count, zones, 1))
        self.length, self.half = np.ones((skin.count, zones)), np.zeros((skin.count, zones, 2))
        for k, sensor in enumerate(skin.sensors):
            u, kind = zone_centres(sensor), sensor.type
            self.u[k, : kind.zones] = u
            if kind.radial:
                self.length[k, : kind.zones] = np.linalg.norm(u, axis=1)
            down, across = kind.pitch
            pitch = (down, across) if sensor.rotation_deg % 180 else (across, down)
            self.half[k, : kind.zones] = (1.0 + u[:, :2] ** 2) * np.tan(np.array(pitch) / 2)


def rows_of(
    views: Views, stance: Stance, placed: Placed, around: Surroundings, zones: Zones, T_plane: Array
) -> Rows:
    """All reports of planes, sensor by sensor, zone by zone."""
    target = np.full(views.report.shape, NOTHING, dtype=np.int32)
    normal = np.zeros((*views.report.shape, 3))
    height, bent = np.zeros(views.report.shape), np.zeros(views.report.shape)
    for group in _groups(stance):
        posture = stance.postures[group[0]]
        there = _at(posture, stance.T_base_link[group[0]])
        seen = around.look(views.sensor[group], there, placed.T_base_sensor[group], T_plane)
        target[group], normal[group] = seen.target, seen.normal
        height[group], bent[group] = seen.height, seen.bent
    v, z = np.nonzero((target != NOTHING) & np.isfinite(views.report))
    order = np.lexsort((z, views.sensor[v]))
    v, z = v[order], z[order]
    k = views.sensor[v]
    return Rows(
        sensor=k, zone=z, view=v, target=target[v, z], u=zones.u[k, z], half=zones.half[k, z],
        length=zones.length[k, z], normal=normal[v, z], height=height[v, z], bent=bent[v, z],
        report=views.report[v, z], frames=views.frames[v, z],
    )  # fmt: skip


def _groups(stance: Stance) -> list[NDArray[np.intp]]:
    """Views of one posture together: their rays are cast at once."""
    groups: dict[int, list[int]] = {}
    for i, posture in enumerate(stance.postures):
        groups.setdefault(id(posture), []).append(i)
    return [np.array(g, dtype=np.intp) for g in groups.values()]


def _at(posture: Posture, T_base_link: Array) -> Posture:
    """The posture with its links displaced."""
    return Posture(
        posture.q, T_base_link, posture.T_base_tool, posture.J_base, posture.supports,
        posture.tool_support, posture.gears,
    )  # fmt: skip


def moved_planes(T_plane: Array, step: Array) -> Array:
    """Planes (P, 4, 4) raised and tilted by (P, 3): along z [m], about x and y [rad]."""
    out = T_plane.copy()
    for T, (up, about_x, about_y) in zip(out, step, strict=True):
        T[:3, 3] += up * T[:3, 2]
        T[:3, :3] = T[:3, :3] @ rotation_matrix(np.array([about_x, about_y, 0.0]))
    return out


def joints_first(planes: int) -> int:
    """The first column of the joints' errors among what all share."""
    return PLANES + 3 * planes
