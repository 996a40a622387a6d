"""Frames and joint states in, pairs out: everything that is believed of the world.

frames ─► cloud (placed at each frame's own time, judged once) ─► memory, speed of the world
       ─► closest pairs of the kind that the controller needs ─► steadied

Nothing behind it feeds back into it: what it believes follows from what was measured alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import Learned
from app.cell.parts import Cell
from app.config import Params
from app.messages import Array, Cloud, JointState, Pairs, SensorFrame, Verdict, freeze
from app.needs import Needs
from app.perception.background import Background
from app.perception.cloud import SkinCloud, Together
from app.perception.memory import Memory
from app.perception.pair_doubt import with_doubt
from app.perception.proximity import BodyPairs, HeldPairs, ManyPairs, MountPairs
from app.perception.rules import Rules, rules_of
from app.perception.steadying import Steadying
from app.perception.uncertainty import TOGETHER, known_of
from app.perception.velocity import ObstacleSpeed
from app.robot.history import JointHistory
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

KEPT, CONTACT = int(Verdict.KEPT), int(Verdict.CONTACT)  # numpy is slow with an enum
VISITED = -0.01  # [m] a remembered point this deep inside a link is not there any more
LAST_VISIT = 3  # see `Memory.visited`
REACH = 0.6  # [m] several pairs a link are looked for up to here: the QP's largest use of them
# [m] a link keeps its point unless another is nearer by more: one deviation of a zone's range,
# without it the point of a flat wall jumps 44 times in 10 s (specification, section 1.6)
HELD = 0.01
Lap = Callable[[str], None]


@dataclass(frozen=True, eq=False, slots=True)
class Percept:
    """What is believed at one tick.

    pairs:  those measured now, of the kind that the controller needs.   body: the whole body's.
    steady: what the controller is told: `pairs` followed from tick to tick.
    memory: (n, 3) [m] remembered points near the arm, base frame.
    """

    posture: Posture
    cloud: Cloud
    pairs: Pairs
    steady: Pairs
    body: Pairs
    memory: Array


class Perception:
    """Holds all that is remembered of frames and joint states; no clock, no device."""

    def __init__(self, robot: Robot, skin: Skin, cell: Cell) -> None:
        self._robot, self._skin, self._cell = robot, skin, cell
        self._history = JointHistory(robot.n)
        self._cloud = SkinCloud(robot, skin, cell)
        self._body = BodyPairs(robot)
        self._memory = Memory(robot, skin)
        self._speed = ObstacleSpeed(skin)
        self._held, self._many = HeldPairs(self._body), ManyPairs(self._body)
        self._mounts, self._steadying = MountPairs(skin), Steadying()
        self._known = known_of(skin)
        self._kind = ""  # of the pairs that are followed

    @property
    def background(self) -> Background:
        """The learned background."""
        return self._cloud.background

    @property
    def unable(self) -> NDArray[np.uint8]:
        """(K,) of `Unable`: which sensors' frames tell that they cannot see."""
        return self._cloud.unable

    def know(self, learned: Learned) -> None:
        """From now on this is what was learned of the cell; what is remembered there was it."""
        self._cloud.static_filter.know(learned)
        points = self._memory.points
        known = np.flatnonzero(self._cloud.static_filter.inside(points))
        for _ in range(LAST_VISIT):
            self._memory.visited(known)

    def reset(self) -> None:
        """Know nothing but the cell that was given."""
        self._history.reset()
        self._cloud.background = Background(self._cell.learned)
        self.know(self._cell.learned)
        self._cloud.reset()
        self._memory.reset()
        self.begin_anew()

    def begin_anew(self) -> None:
        """Follow no pair and no motion of before; frames and memory live by their own age."""
        self._body.reset()
        self._speed.reset()
        self._held.reset()
        self._many.reset()
        self._steadying.reset()
        self._kind = ""

    def update(
        self,
        frames: Sequence[SensorFrame],
        joints: JointState,
        posture: Posture,
        params: Params,
        needs: Needs,
        dt: float,
        lap: Lap,
    ) -> Percept:
        """What is believed at `joints`, with the pairs that the controller needs.

        posture: at `joints.q`.   dt: [s] since the last tick.
        """
        rules = rules_of(params, needs.as_published)
        self._history.append(joints)
        lap("kinematics")
        self._take(frames, rules)
        cloud = self._cloud.view(joints.stamp)
        lap("filter")
        points, use = self._world_points(cloud, posture, joints.stamp, rules)
        body = self._body.search(points, use, posture)
        pairs = self._pairs(needs, body, points, use, posture, joints.stamp)
        if rules.obstacle_speed:
            pairs = self._speed.update(pairs, joints.stamp)
        if not needs.as_published:
            pairs = with_doubt(pairs, cloud, self._memory.seen, posture, joints, self._known)
        steady = self._steadied(pairs, posture, needs, dt)
        if rules.memory:
            self._revise_memory(body, len(cloud.points), joints.stamp, rules)
        memory = freeze(self._memory.points[self._memory.near])
        lap("pairs")
        return Percept(posture, cloud, pairs, steady, body, memory)

    def recall(self, joints: JointState, params: Params) -> Percept:
        """What was believed before, at the present posture: for a tick that trusts nothing new."""
        posture = self._robot.posture(joints.q)
        cloud = self._cloud.view(joints.stamp)
        points, use = self._world_points(cloud, posture, joints.stamp, rules_of(params, False))
        body = self._body.search(points, use, posture)
        return Percept(posture, cloud, body, body, body, np.empty((0, 3)))

    def _take(self, frames: Sequence[SensorFrame], rules: Rules) -> None:
        """Judge new frames at the posture that the arm had when they were measured."""
        if late := self._skin.late:
            frames = [replace(f, stamp=f.stamp - late) for f in frames]
        groups = [self._placed(together) for together in in_one_go(frames)]
        for apart in of_other_sensors(groups):
            judged = self._cloud.foresee(apart, rules)
            for group, of in zip(judged, apart, strict=True):
                self._cloud.take(group, rules)
                self._remember(of, rules)

    def _placed(self, frames: Sequence[SensorFrame]) -> Together:
        """Frames with the arm as it was when they were measured."""
        stamp = (frames[0].stamp + frames[-1].stamp) / 2.0
        posture = self._robot.posture(self._history.at(stamp))
        return Together(frames, posture, self._history.speed(stamp))

    def _remember(self, group: Together, rules: Rules) -> None:
        """Take note of what the cloud has just taken in."""
        if not (rules.memory or rules.obstacle_speed):
            return
        sensors, judged = np.array([f.sensor for f in group.frames]), self._cloud.newest()
        if rules.obstacle_speed:
            self._speed.take(judged, sensors)
        if rules.memory:
            self._memory.update(judged, sensors, group.posture, self._cloud.doubted)

    def _world_points(
        self, cloud: Cloud, posture: Posture, now: float, rules: Rules
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Points (n, 3) to keep clear of and which are in use: the cloud's, then the memory's."""
        points, use = cloud.points, (cloud.verdict == KEPT) | (cloud.verdict == CONTACT)
        if not rules.memory:
            self._memory.reset()
            return points, use
        self._memory.age(now, posture)
        return (
            np.concatenate((points, self._memory.points)),
            np.concatenate((use, self._memory.near)),
        )

    def _pairs(
        self, needs: Needs, body: Pairs, points: Array, use: NDArray[np.bool_], posture: Posture,
        now: float,
    ) -> Pairs:  # fmt: skip
        if needs.pairs == "mounts":
            return self._mounts.search(points, use, posture)
        if needs.pairs == "several":
            return self._many.update(body, points, use, posture, REACH, now)
        hold = 0.0 if needs.as_published else HELD
        return self._held.update(body, points, use, posture, hold)

    def _steadied(self, pairs: Pairs, posture: Posture, needs: Needs, dt: float) -> Pairs:
        """`pairs` without the sensors' noise, for every controller alike."""
        if needs.as_published:
            return pairs
        if needs.pairs != self._kind:
            self._steadying.reset()
            self._kind = needs.pairs
        return self._steadying.update(posture, pairs, needs.reach, dt)

    def _revise_memory(self, body: Pairs, current: int, now: float, rules: Rules) -> None:
        """Tell the memory what moves, and where the arm's own body has been."""
        if rules.obstacle_speed:  # without it nobody renews what was found to move
            self._memory.mark_moving(self._speed.moving(), now)
        inside = (body.distance < VISITED) & (body.slot >= current)
        self._memory.visited(body.slot[inside] - current)


def in_one_go(frames: Sequence[SensorFrame]) -> list[list[SensorFrame]]:
    """Frames that are judged together, at one posture: of stamps within `TOGETHER`, in order."""
    out: list[list[SensorFrame]] = []
    for f in sorted(frames, key=_stamp):
        if out and f.stamp - out[-1][0].stamp <= TOGETHER:
            out[-1].append(f)
        else:
            out.append([f])
    return out


def of_other_sensors(groups: Sequence[Together]) -> list[list[Together]]:
    """The groups in their order, parted where a sensor comes again."""
    out: list[list[Together]] = []
    seen: set[int] = set()
    for group in groups:
        mine = {f.sensor for f in group.frames}
        if not out or seen & mine:
            out.append([])
            seen = set()
        out[-1].append(group)
        seen |= mine
    return out


def _stamp(frame: SensorFrame) -> float:
    return frame.stamp
