"""The tick: place, clean, measure, decide. The only file that knows the order of the rooms.

frames ─► cloud (placed at each frame's own time, judged once) ─► closest pairs
       ─► command that gives way first and goes to the goal second
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

from app.config import ControlMode, Params
from app.control.avoidance import Avoidance
from app.control.stuck import Stuck
from app.control.whole_body import WholeBody
from app.messages import Cloud, Command, CropBox, Goal, JointState, Pairs, SensorFrame
from app.perception.cloud import SkinCloud
from app.perception.proximity import BodyPairs, MountPairs
from app.robot.history import JointHistory
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.timing import Stopwatch


@dataclass(frozen=True, eq=False, slots=True)
class Outcome:
    """What one tick found and decided. `pairs` are those acted on, `body` the whole body's."""

    posture: Posture
    cloud: Cloud
    pairs: Pairs
    body: Pairs
    command: Command


class Pipeline:
    """Frames and joint states in, a command out; no clock, no thread, no device."""

    def __init__(self, robot: Robot, skin: Skin, crops: Sequence[CropBox] = ()) -> None:
        self._robot = robot
        self._history = JointHistory(robot.n)
        self._cloud = SkinCloud(robot, skin, crops)
        self._body = BodyPairs(robot)
        self._mounts = MountPairs(skin)
        closest = Avoidance(robot)
        self._controllers: dict[ControlMode, Avoidance | WholeBody] = {
            "wb": closest,
            "sm": closest,
            "multi": Avoidance(robot, "links"),
            "qp": WholeBody(robot, crops),
        }
        self._control: Avoidance | WholeBody = closest
        self._stuck = Stuck()

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
            self._cloud.take(list(group), then, params)
        cloud = self._cloud.view(joints.stamp, params)
        watch.lap("filter")
        body = self._body.update(cloud, posture)
        pairs = self._mounts.update(cloud, posture) if params.mode == "sm" else body
        watch.lap("pairs")
        self._choose(params.mode)
        if moving:
            tool, now = posture.T_base_tool, joints.stamp
            goal = self._stuck.goal(goal, tool, now)
            command = self._control.update(posture, joints, pairs, goal, params, dt, share=share)
            self._stuck.see(tool, pairs, command, params.escape, now)
            if self._stuck.words and not command.reason:
                command = replace(command, reason=self._stuck.words)
        else:
            self._stuck.reset()
            command = self._control.brake(joints, dt)
        watch.lap("control")
        return Outcome(posture, cloud, pairs, body, command)

    def brake(self, joints: JointState, params: Params, dt: float) -> Outcome:
        """A tick that trusts nothing new: the last cloud, no pairs acted on, brake to rest."""
        posture = self._robot.posture(joints.q)
        cloud = self._cloud.view(joints.stamp, params)
        body = self._body.update(cloud, posture)
        return Outcome(posture, cloud, body, body, self._control.brake(joints, dt))

    def _choose(self, mode: ControlMode) -> None:
        """Another controller goes on from the command that is in force."""
        chosen = self._controllers[mode]
        if chosen is not self._control:
            chosen.reset(self._control.previous)
            self._control = chosen


def _stamp(frame: SensorFrame) -> float:
    return frame.stamp
