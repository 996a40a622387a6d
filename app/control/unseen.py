"""No part of the body goes into unseen space faster than it can stop before it.

For every unseen point, at a distance d from a link, and the speed v at which the link's nearest
point comes towards it,

    v T + v^2 / (2 a) <= d        v <= sqrt((a T)^2 + 2 a d) - a T

with the reaction time T and the braking a of speed and separation. The command is slowed as a
whole, so that the motion keeps its direction; motion away from what is unseen, or beside it,
costs nothing. Links are the capsules that hold them.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.control.controller import Situation
from app.control.gaps import Pieces, Placed, place
from app.control.limits import bring_into, velocity_box
from app.messages import Array, Command, freeze
from app.robot.model import Robot

ALL = 0.999  # of the speed: what is left of it counts as the whole


class Unseen(NamedTuple):
    """n points: where, in the frame of their link, (n, 3) [m]; the link and the sensor (n,)."""

    point: Array
    link: NDArray[np.int64]
    sensor: NDArray[np.int64]


NOTHING_UNSEEN = Unseen(np.empty((0, 3)), *np.empty((2, 0), dtype=np.int64))


class Motion(NamedTuple):
    """How the links move: poses (L, 4, 4), linear velocity of what is at the base's origin and
    angular velocity (L, 6), and which links move as one (L, L)."""

    T_base_link: Array
    twist: Array
    welded: NDArray[np.bool_]


class UnseenLimit:
    """Slows commands; remembers nothing."""

    def __init__(self, robot: Robot, pieces: Pieces) -> None:
        self._robot, self._pieces = robot, pieces

    def slowed(self, command: Command, now: Situation, unseen: Unseen) -> Command:
        """The command, or less of it."""
        if not len(unseen.point):
            return command
        posture, params = now.posture, now.params
        twist = (posture.supports * command.qd) @ posture.J_base.T
        motion = Motion(posture.T_base_link, twist, self._robot.welded)
        share, row = _share(unseen, motion, self._pieces, params.reaction_time, params.braking)
        if share > ALL:
            return command
        box = velocity_box(self._robot, now.joints.q, 1.0, now.dt)
        qd = bring_into(share * command.qd, now.applied, box)[0]
        return replace(
            command, qd=freeze(qd), progress=share * command.progress, unseen=share,
            unseen_of=int(unseen.sensor[row]),
        )  # fmt: skip


@compiled
def _share(unseen: Unseen, motion: Motion, pieces: Pieces, T: float, a: float) -> tuple[float, int]:
    """How much of the motion leaves the body time to stop, and the point that holds it, or -1."""
    placed, p = place(motion.T_base_link, pieces), np.empty(3)
    share, held = 1.0, -1
    for n in range(len(unseen.point)):
        A, mount = motion.T_base_link[unseen.link[n]], unseen.link[n]
        for i in range(3):
            p[i] = A[i, 3]
            for j in range(3):
                p[i] += A[i, j] * unseen.point[n, j]
        mine = _share_at(p, mount, motion, pieces, placed, T, a)
        if mine < share:
            share, held = mine, n
    return share, held


@compiled
def _share_at(
    p: Array, mount: int, motion: Motion, pieces: Pieces, placed: Placed, T: float, a: float
) -> float:
    """The same for one point p (3,), base frame, before a sensor of link `mount`.

    A point inside another link is no space: that link is in the sensor's way there.
    """
    share, w = 1.0, np.empty(3)
    for q in range(len(pieces.radius)):
        link, end = pieces.link[q], placed.ends[q]
        along, square = 0.0, 0.0
        for i in range(3):
            along += (p[i] - end[0, i]) * (end[1, i] - end[0, i])
            square += (end[1, i] - end[0, i]) ** 2
        t = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        length = 0.0
        for i in range(3):
            w[i] = p[i] - end[0, i] - t * (end[1, i] - end[0, i])
            length += w[i] * w[i]
        length = np.sqrt(length)
        d = length - pieces.radius[q]
        if d < 0.0 and not motion.welded[mount, link]:
            return 1.0
        v = motion.twist[link]
        towards = (
            w[0] * (v[0] + v[4] * p[2] - v[5] * p[1])
            + w[1] * (v[1] + v[5] * p[0] - v[3] * p[2])
            + w[2] * (v[2] + v[3] * p[1] - v[4] * p[0])
        ) / max(length, 1e-9)
        allowed = np.sqrt((a * T) ** 2 + 2.0 * a * max(d, 0.0)) - a * T
        if towards > max(allowed, 1e-9):
            share = min(share, allowed / towards)
    return share
