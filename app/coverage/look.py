"""Coverage at one posture: what each sensor contributes is kept, so that one may be taken out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.coverage.cones import Cones, cones_of, packed, poses_of
from app.coverage.first_seen import first_seen
from app.coverage.occlusion import Views, blocked, hidden_sensors, views_of
from app.coverage.patches import COUNT, Patches, Posed, patches_of, posed
from app.messages import Array
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

RADIUS, FAR = 0.05, 1.5  # [m] of a hand; from where it comes


@dataclass(frozen=True, eq=False, slots=True)
class Subject:
    """What is looked at: an arm, its skin, its patches and the zones' views.

    radius: [m] of the sphere that comes.   far: [m] from where.
    """

    robot: Robot
    skin: Skin
    patches: Patches
    cones: Cones
    radius: float = RADIUS
    far: float = FAR


@dataclass(frozen=True, eq=False, slots=True)
class Look:
    """Coverage of P patches from M directions by K sensors at one posture.

    at:     the patches in the base frame.   T_base_sensor: (K, 4, 4).
    views:  what the zones see of the room.   hidden: (K,) bool, sensors that look into the arm.
    barred: (P, M) bool, the arm itself stands in the way.
    gap:    (K, P, M) [m] at which each sensor first sees what comes; 0: never.
    """

    at: Posed
    T_base_sensor: Array
    views: Views
    hidden: NDArray[np.bool_]
    barred: NDArray[np.bool_]
    gap: NDArray[np.float32]

    def seen(self, working: NDArray[np.bool_] | None = None) -> Array:
        """(P, M) [m] gap at which what comes is first seen by a sensor that is `working` (K,);
        0: never; NaN where the arm itself stands in the way."""
        gap = self.gap if working is None else self.gap[working]
        best = gap.max(axis=0, initial=0.0).astype(np.float64)
        return np.where(self.barred, np.nan, best)


def subject_of(
    robot: Robot, skin: Skin, count: int = COUNT, reach: float | None = None,
    radius: float = RADIUS, far: float = FAR,
) -> Subject:  # fmt: skip
    """An arm and its skin with about `count` patches; reach: see `cones_of`."""
    return Subject(robot, skin, patches_of(robot, count), cones_of(skin, reach), radius, far)


def look(subject: Subject, posture: Posture) -> Look:
    """Coverage at a posture."""
    return look_at(subject, posture.T_base_link)


def look_at(subject: Subject, T_base_link: Array) -> Look:
    """Coverage of links posed at T_base_link (L, 4, 4)."""
    robot, skin, cones = subject.robot, subject.skin, subject.cones
    T_base_link = np.array(T_base_link)
    at = posed(subject.patches, T_base_link)
    views = views_of(robot, skin, cones, T_base_link)
    barred = blocked(robot, at, T_base_link, subject.far)
    T_base_sensor = poses_of(cones, T_base_link)
    gap = first_seen(
        at.point, at.direction, barred, T_base_sensor, packed(cones, views.free),
        subject.radius, subject.far,
    )  # fmt: skip
    return Look(at, T_base_sensor, views, hidden_sensors(skin, views), barred, gap)
