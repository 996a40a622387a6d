"""Who ran into whom? Touches, and how fast the arm's own point went towards what it touched.

A person who walks into a standing arm touches it; that is no fault of the arm's. A touch is the
arm's own where the touched point moves towards the body by itself, faster than `INTO`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.judge.free_direction import speed_row
from app.judge.truth import TrueDistance, TruePair
from app.messages import Array, BodyPose
from app.robot.model import Robot
from app.robot.posture import Posture
from app.world.shapes import Shape

INTO = 0.02  # [m/s] of the touched point towards the body
TOUCHING = 1e-9  # [m] true distance of a touch


def speed_towards(robot: Robot, q: Array, qd: Array, pair: TruePair) -> float:
    """[m/s] at which the arm moves a pair's point towards the body, whatever the body does."""
    return float(-speed_row(robot, q, pair) @ qd)


def led_away(posture: Posture, qd: Array, T_base_link: Array, point: Array) -> float:
    """[m/s] at which the arm leads the link away that is nearest to a point (3,) of the world, of
    those that it can lead anywhere: two joints move them. Measured at the links' origins."""
    able = np.flatnonzero(posture.supports.sum(axis=1) >= 2)
    away = T_base_link[able, :3, 3] - point
    far = np.linalg.norm(away, axis=1)
    i = int(np.argmin(far))
    twist = posture.link_twists(qd)[able[i]]
    velocity = twist[:3] + np.cross(twist[3:], T_base_link[able[i], :3, 3])
    return float(away[i] @ velocity / far[i])


@dataclass(frozen=True, slots=True)
class Contact:
    """One touch, from when it began at [s]; own: [m/s] the most of `speed_towards` while it
    lasted."""

    at: float
    link: int
    body: str
    own: float

    @property
    def moved_into(self) -> bool:
        """Is it the arm that ran into the body?"""
        return self.own > INTO


class Contacts:
    """Takes note of each moving link's touches with each body; of the arm as it truly is."""

    def __init__(self, robot: Robot, truth: TrueDistance, shapes: Mapping[str, Shape]) -> None:
        self.found: list[Contact] = []
        self._robot, self._truth, self.shapes = robot, truth, shapes
        self._moves = np.asarray(robot.supports.any(axis=1))
        self._lasting: dict[tuple[int, str], int] = {}  # rows of `found`

    def update(
        self, now: float, q: Array, qd: Array, T_base_link: Array, bodies: Sequence[BodyPose]
    ) -> None:
        """The true state at `now` [s]: joint positions and velocities (n,), links (L, 4, 4)."""
        pairs = self._truth.near_pairs(T_base_link, self.shapes, bodies, TOUCHING)
        lasting = {}
        for p in pairs:
            if not self._moves[p.link]:
                continue
            key, own = (p.link, p.body), speed_towards(self._robot, q, qd, p)
            row = self._lasting.get(key, len(self.found))
            if row == len(self.found):
                self.found.append(Contact(now, p.link, p.body, own))
            elif own > self.found[row].own:
                self.found[row] = replace(self.found[row], own=own)
            lasting[key] = row
        self._lasting = lasting
