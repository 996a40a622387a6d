"""The tick: place, clean, measure, decide. The only file that knows the order of the rooms.

frames ─► cloud (placed at each frame's own time, judged once) ─► closest pairs
       ─► command that gives way first and goes to the goal second
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from app.config import ControlMode, Params
from app.control.avoidance import Avoidance
from app.control.separation import in_use
from app.control.stuck import Stuck
from app.control.whole_body import WholeBody
from app.messages import (
    SLOTS,
    Array,
    Cloud,
    Command,
    CropBox,
    Goal,
    JointState,
    Pairs,
    SensorFrame,
    Verdict,
    freeze,
)
from app.perception.background import Background
from app.perception.cloud import SkinCloud
from app.perception.memory import Memory
from app.perception.proximity import BodyPairs, ManyPairs, MountPairs, SteadyPairs
from app.perception.velocity import ObstacleSpeed
from app.robot.history import JointHistory
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.timing import Stopwatch

KEPT = int(Verdict.KEPT)  # numpy is slow with an enum
VISITED = -0.01  # [m] a remembered point this deep inside a link is not there any more
REACH = 0.6  # [m] several pairs a link are looked for up to here


@dataclass(frozen=True, eq=False, slots=True)
class Outcome:
    """What one tick found and decided. `pairs` are those acted on, `body` the whole body's.

    jump: [m] how far the acted-on control point moved since the last tick, 0 without one.
    memory: (n, 3) [m] remembered points near the arm, base frame.
    """

    posture: Posture
    cloud: Cloud
    pairs: Pairs
    body: Pairs
    command: Command
    jump: float = 0.0
    memory: Array = field(default_factory=lambda: np.empty((0, 3)))


class Pipeline:
    """Frames and joint states in, a command out; no clock, no thread, no device."""

    def __init__(self, robot: Robot, skin: Skin, crops: Sequence[CropBox] = ()) -> None:
        self._robot = robot
        self._history = JointHistory(robot.n)
        self._cloud = SkinCloud(robot, skin, crops)
        self._body = BodyPairs(robot)
        self._memory = Memory(robot, skin)
        self._speed = ObstacleSpeed(skin)
        self._steady, self._many = SteadyPairs(self._body), ManyPairs(self._body)
        self._mounts = MountPairs(skin)
        self._point: Array | None = None  # control point of the last tick
        closest = Avoidance(robot)
        self._bounds = WholeBody(robot, crops)
        self._controllers: dict[ControlMode, Avoidance | WholeBody] = {
            "wb": closest,
            "sm": closest,
            "multi": Avoidance(robot, "links"),
            "qp": self._bounds,
            "ssm": self._bounds,
        }
        self._control: Avoidance | WholeBody = self._bounds
        self._stuck = Stuck()

    @property
    def background(self) -> Background:
        """The learned background."""
        return self._cloud.background

    def tick(
        self,
        frames: Sequence[SensorFrame],
        joints: JointState,
        goal: Goal | None,
        params: Params,
        dt: float,
        moving: bool = True,
        watch: Stopwatch | None = None,
        share: float = 1.0,
    ) -> Outcome:
        """One step at `joints.stamp`, `dt` [s] after the last one.

        goal: where the tool should go, None to rest. moving: False brakes to rest.
        share: 0..1 of the allowed speed, less while the sensors are silent.
        """
        watch = watch or Stopwatch()
        self._history.append(joints)
        posture = self._robot.posture(joints.q)
        watch.lap("kinematics")
        for stamp, group in groupby(sorted(frames, key=_stamp), key=_stamp):
            then = self._robot.posture(self._history.at(stamp))
            together = list(group)
            self._cloud.take(together, then, params)
            if params.memory or params.obstacle_speed:
                sensors, judged = np.array([f.sensor for f in together]), self._cloud.newest()
                if params.obstacle_speed:
                    self._speed.take(judged, sensors)
                if params.memory:
                    self._memory.update(judged, sensors, then)
        cloud = self._cloud.view(joints.stamp, params)
        watch.lap("filter")
        points, use = self._world_points(cloud, posture, joints.stamp, params)
        body = self._body.search(points, use, posture)
        if params.mode == "sm":
            pairs = self._mounts.search(points, use, posture)
        elif params.many_pairs and self._controllers[params.mode] is self._bounds:
            pairs = self._many.update(body, points, use, posture, REACH, joints.stamp)
        else:
            pairs = self._steady.update(body, points, use, posture, params.pair_hold)
        if params.obstacle_speed:
            pairs = self._speed.update(pairs, joints.stamp)
        if in_use(params):
            pairs = replace(pairs, age=self._ages(pairs, cloud, joints.stamp))
        if params.memory:
            self._memory.mark_moving(self._speed.moving(), joints.stamp)
            inside = (body.distance < VISITED) & (body.slot >= len(cloud.points))
            self._memory.visited(body.slot[inside] - len(cloud.points))
        watch.lap("pairs")
        self._choose(params.mode)
        if moving:
            tool, now = posture.T_base_tool, joints.stamp
            goal = self._stuck.goal(goal, tool, now)
            command = self._control.update(
                posture, joints, pairs, goal, params, dt, pairs.approach, share
            )
            self._stuck.see(tool, pairs, command, params.escape, now)
            if self._stuck.words and not command.reason:
                command = replace(command, reason=self._stuck.words)
        else:
            self._stuck.reset()
            command = self._control.brake(joints, dt)
        watch.lap("control")
        memory = freeze(self._memory.points[self._memory.near])
        return Outcome(
            posture, cloud, pairs, body, command, self._jump(pairs, command), memory
        )  # fmt: skip

    def _world_points(
        self, cloud: Cloud, posture: Posture, now: float, params: Params
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Points (n, 3) to keep clear of and which are in use: the cloud's, then the memory's."""
        points, use = cloud.points, cloud.verdict == KEPT
        if not params.memory:
            self._memory.reset()
            return points, use
        self._memory.age(now, posture)
        return (
            np.concatenate((points, self._memory.points)),
            np.concatenate((use, self._memory.near)),
        )

    def _ages(self, pairs: Pairs, cloud: Cloud, now: float) -> Array:
        """(B,) [s] since each pair's world point was measured."""
        age, slot, current = np.full(len(pairs.slot), np.inf), pairs.slot, len(cloud.points)
        seen, kept = (slot >= 0) & (slot < current), slot >= current
        age[seen] = now - cloud.stamp[slot[seen] // SLOTS]
        age[kept] = self._memory.ages(slot[kept] - current, now)
        return freeze(age)

    def _jump(self, pairs: Pairs, command: Command) -> float:
        """How far the control point has moved since the last tick [m]."""
        before, row = self._point, command.control_row
        self._point = pairs.on_robot[row] if row >= 0 else None
        if before is None or self._point is None:
            return 0.0
        return float(np.linalg.norm(self._point - before))

    def brake(self, joints: JointState, params: Params, dt: float) -> Outcome:
        """A tick that trusts nothing new: the last cloud, no pairs acted on, brake to rest."""
        posture = self._robot.posture(joints.q)
        cloud = self._cloud.view(joints.stamp, params)
        points, use = self._world_points(cloud, posture, joints.stamp, params)
        body = self._body.search(points, use, posture)
        return Outcome(posture, cloud, body, body, self._control.brake(joints, dt))

    def _choose(self, mode: ControlMode) -> None:
        """Another controller goes on from the command that is in force."""
        chosen = self._controllers[mode]
        if chosen is not self._control:
            chosen.reset(self._control.previous)
            self._control = chosen


def rehearse(robot: Robot, skin: Skin, crops: Sequence[CropBox], params: Params) -> None:
    """Tick a pipeline of its own once in every way, so that nothing compiles while moving.

    Seconds on the very first start, a moment once the kernels' cache on disk is filled.
    """
    pipeline = Pipeline(robot, skin, crops)
    still = freeze(np.zeros(robot.n))  # as an arm's state is
    here = Goal(robot.posture(robot.home).T_base_tool)
    full = (np.full(SLOTS, 5, dtype=np.uint8), np.ones(SLOTS, dtype=np.uint8))
    stamp = 0.0
    for mode in get_args(ControlMode):
        for memory in (False, True):
            for depth, later in ((0.3, 0.1), (0.31, 0.1), (0.31, 0.004)):  # the last holds pairs
                stamp += later
                frames = [
                    SensorFrame(k, stamp, 0, np.full(SLOTS, depth), *full)
                    for k in range(skin.count)
                ]
                now = replace(params, mode=mode, memory=memory, many_pairs=memory)
                pipeline.tick(frames, JointState(stamp, robot.home, still), here, now, 0.004)
    pipeline._memory.mark_moving(np.zeros((1, 3)), stamp)  # here nothing has moved


def _stamp(frame: SensorFrame) -> float:
    return frame.stamp
