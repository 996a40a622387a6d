"""Sensors that look into what they ride on: at every posture they see that, and nothing else.

What moves as one with a sensor's link, covers and tools too, is before its lens at all times.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.robot.meshes import BodyMesh
from app.robot.model import Robot
from app.robot.roundness import across
from app.robot.skin import Skin

RAYS = [(0.0, 0.0)] + [(a, 60.0 * i) for a in (5.0, 10.0) for i in range(6)]  # [deg] off, round
NEAR = 0.1  # [m] what is farther ahead leaves room to see something before it
SHARE = 0.5  # of the rays: a sensor that sees past an edge is not blind


class Blind(NamedTuple):
    """A sensor, the body link that it looks into, and how far before it that is [m]; a lens inside
    it has `ahead` zero."""

    sensor: str
    link: str
    ahead: float


def blind_sensors(robot: Robot, skin: Skin) -> tuple[Blind, ...]:
    """The sensors of a skin that can see nothing but what they ride on, in the skin's order."""
    out = []
    for k, sensor in enumerate(skin.sensors):
        near = np.full(len(RAYS), np.inf)
        first = np.full(len(RAYS), -1)
        for i in np.flatnonzero(robot.welded[skin.link[k]]):
            T = robot.T_link_link(int(i), int(skin.link[k]))
            lens = T[:3, :3] @ skin.origin[k] + T[:3, 3]
            if _inside(lens, robot.bodies[i]):
                near[:], first[:] = 0.0, i
                break
            d = _rays(T[:3, :3] @ skin.axis[k])
            o = np.tile(lens.astype(np.float32), (len(d), 1))
            t = robot.rigid[i].cast(o, d.astype(np.float32))
            first[t < near] = i
            near = np.minimum(near, t)
        blocked = near < NEAR
        if blocked.mean() > SHARE:
            link = int(np.bincount(first[blocked]).argmax())
            out.append(Blind(sensor.name, robot.links[link], float(np.median(near[blocked]))))
    return tuple(out)


def blind_words(robot: Robot, skin: Skin) -> tuple[str, ...]:
    """One line for each body that sensors look into: who, what, and the remedy."""
    lines: dict[str, list[Blind]] = {}
    for blind in blind_sensors(robot, skin):
        lines.setdefault(blind.link, []).append(blind)
    return tuple(blind_words_of(blind, robot) for blind in lines.values())


def blind_words_of(blind: Sequence[Blind], robot: Robot) -> str:
    """One line for sensors that look into the same body."""
    link, where = blind[0].link, robot.layout.name if robot.layout else "the layout"
    names, ahead = ", ".join(b.sensor for b in blind), max(b.ahead for b in blind)
    look, see, them = ("looks", "sees", "it") if len(blind) == 1 else ("look", "see", "them")
    place = f"{1e3 * ahead:.0f} mm ahead" if ahead > 0.0 else "in which the lens is"
    return (
        f"{names} {look} into {link}, {place}, and {see} nothing else: raise radius_m, or move or "
        f"turn {them} in {where}, and "
        "leave `body` out of its [cover] if that was modelled for other rings"
    )


def _rays(axis: Array) -> Array:
    """(n, 3) unit directions round an optical axis (3,)."""
    u, v = across(axis)
    off, turn = np.radians(np.array(RAYS)).T[:, :, None]
    return np.asarray(np.cos(off) * axis + np.sin(off) * (np.cos(turn) * u + np.sin(turn) * v))


def _inside(point: Array, body: BodyMesh) -> bool:
    """Is a point (3,) inside a closed mesh? By the solid angle that its faces fill round it.

    A face with corners a, b, c fills 2 atan2(a . (b x c), abc + (a . b) c + (b . c) a + (c . a) b)
    (Van Oosterom and Strackee 1983); a surface round the point fills 4 pi.
    """
    if ((point < body.vertices.min(axis=0)) | (point > body.vertices.max(axis=0))).any():
        return False
    return bool(_filled(point, body.vertices, body.faces) > 2.0 * np.pi)


@compiled
def _filled(point: Array, vertices: Array, faces: NDArray[np.int64]) -> float:
    """The solid angle that faces (F, 3) fill round a point (3,)."""
    v, length, total = np.empty((3, 3)), np.empty(3), 0.0
    for f in range(len(faces)):
        for k in range(3):
            for i in range(3):
                v[k, i] = vertices[faces[f, k], i] - point[i]
            length[k] = np.sqrt(v[k, 0] ** 2 + v[k, 1] ** 2 + v[k, 2] ** 2)
        triple, below = 0.0, length[0] * length[1] * length[2]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            triple += v[0, i] * (v[1, j] * v[2, k] - v[1, k] * v[2, j])
            dot = v[i, 0] * v[j, 0] + v[i, 1] * v[j, 1] + v[i, 2] * v[j, 2]
            below += dot * length[k]
        total += 2.0 * np.arctan2(triple, below)
    return total
