"""The brain: `Inputs` in, `Outputs` out; which frame becomes which command is decided here.

    actions ─► what people want        ┐
    reports ─► may the arm move at all ├─► perception ─► controller ─► command
    frames  ─► what is there           ┘

No clock, no thread, no device, no world: the same Inputs give the same Outputs to the last
bit. Motion stops on any doubt, with a reason; only a person's action sets it going again.
"""

import traceback
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from app.actions import Jog, JogJoints, Want
from app.cell.parts import Cell
from app.config import Params
from app.control.clearance import Clearance
from app.control.controller import Situation
from app.control.controllers import Controllers
from app.control.errand import Errand
from app.control.nearness import nearness
from app.control.path import StraightPath
from app.control.programs import Program, ProgramRun, Waypoint
from app.control.wish import granted
from app.digest import digest
from app.errors import FlinchError
from app.guard import Guard
from app.messages import Array, Command, Goal, Granted, JointState, Mode, Wish, freeze
from app.near import Nearness
from app.perception.blindness import Cones
from app.perception.look import Links
from app.perception.perceiver import Perceiver
from app.perception.perception import Percept, Perception
from app.perception.self_filter import SelfFilter
from app.raycast import RigidMesh
from app.robot.model import Robot
from app.robot.skin import Skin
from app.state import Room, State, capture, restore
from app.state_bytes import from_bytes, to_bytes
from app.tick import Inputs, Outputs
from app.wishes import Wishes

# what a brain is built on and never changes; a self filter holds nothing but rays and scratch
FACTS = (Robot, Skin, RigidMesh, Links, SelfFilter, Clearance, Cones)

# what its state may come to hold later on
LATER = (Goal, Program, ProgramRun, StraightPath, Waypoint, Jog, JogJoints, Want, Granted, Wish)


def no_lap(room: str) -> None:
    """Nobody times the rooms."""


class Born(NamedTuple):
    """What a brain begins with, and begins with again after a reset."""

    params: Params
    goal: Goal | None
    programs: Mapping[str, Program]
    begin: Mode


class Brain:
    """One arm's mind; `begin` is the mode that it enters when the sensors first speak."""

    def __init__(
        self,
        robot: Robot,
        skin: Skin,
        cell: Cell | None = None,
        params: Params | None = None,
        *,
        goal: Goal | None = None,
        programs: Mapping[str, Program] | None = None,
        begin: Mode = Mode.RUNNING,
        perception: Perceiver | None = None,
    ) -> None:
        """perception: a study's own; None, and everywhere else: what follows from frames."""
        self.robot, self.skin, self.cell = robot, skin, cell or Cell()
        self.born = Born(params or Params(), goal, dict(programs or {}), begin)
        self._perception = perception or Perception(robot, skin, self.cell)
        self._controllers = Controllers(robot, self.cell)
        self.reset()

    def sibling(self, mode: str) -> "Brain":
        """A second mind for the same arm and place, with another controller."""
        params, goal, programs, begin = self.born
        params = replace(params, mode=mode)
        return Brain(
            self.robot, self.skin, self.cell, params, goal=goal, programs=programs, begin=begin
        )  # fmt: skip

    def reset(self) -> None:
        """As on the first day: nothing seen, nothing asked for, the settings of the start."""
        params, goal, programs, begin = self.born
        self._perception.reset()
        self._controllers.reset()
        self._controllers.know(self.cell.learned)
        self.wishes = Wishes(params, Errand(self.robot, programs, goal))
        self._guard = Guard(self.robot, self.skin, begin)
        self._point: Array | None = None  # control point of the last tick
        self._granted: Granted | None = None  # what became of a wish in this tick
        self._q = self.robot.home  # the last joint positions that were finite

    def digest(self) -> str:
        """A text for the whole state; equal after equal Inputs."""
        return digest(vars(self), FACTS)

    def capture(self, room: Room | None = None) -> State:
        """The whole state, to be kept while ticks go on; between two ticks only."""
        return capture(vars(self), FACTS, room)

    def restore(self, state: State) -> None:
        """As it was when this brain's `state` was captured; may be done as often as wanted."""
        before = self._perception.background.known
        restore(state)
        known = self._perception.background.known
        if known is not before:
            self._controllers.know(known)  # it lies in what is built on, not in the state

    def written(self, state: State) -> bytes:
        """A captured state as bytes; in any thread."""
        return to_bytes(state, FACTS)

    def read(self, data: bytes) -> State:
        """The state that another brain of the same make has `written`, for this one.

        RecordingError if it does not fit, or is damaged.
        """
        return from_bytes(data, vars(self), FACTS, LATER)

    @property
    def params(self) -> Params:
        """The settings in force."""
        return self.wishes.params

    def tick(self, x: Inputs, lap: Callable[[str], None] = no_lap) -> Outputs:
        """One step; never raises for what a stop can answer. `lap` is told when a room is done."""
        try:
            return self._tick(x, lap)
        except Exception as error:
            # whatever went wrong, the arm stops; the reason is shown, the trace goes out
            stopped = self._guard.mode is Mode.STOPPED
            trace = "" if stopped else traceback.format_exc()
            reason = str(error) if isinstance(error, FlinchError) else f"internal error: {error!r}"
            self._guard.fault(reason, x.now)
            return self._blindly(x, trace)

    def _tick(self, x: Inputs, lap: Callable[[str], None]) -> Outputs:
        if not (np.isfinite(x.joints.q).all() and np.isfinite(x.joints.qd).all()):
            raise FlinchError("the arm reports a joint value that is not finite")
        self._q, self._granted = x.joints.q, None
        posture = self.robot.posture(x.joints.q)
        tool, errand, mind = posture.T_base_tool, self.wishes.errand, self._controllers
        if self._guard.listen(x) or errand.held is None:
            errand.hold(tool)
        engage = self.wishes.heed(x, tool, self._guard, self._perception, mind)
        p = self.params
        frames = self._guard.believed(x.frames)
        seen = self._perception.update(frames, x.joints, posture, p, mind.needs(p), x.dt, lap)
        share, moving = self._guard.judge(x, p.silence, self._perception.unable)
        mode = self._guard.mode
        goal = errand.update(mode, moving, tool, x.dt)
        wish = errand.wish(mode, moving, x.now, x.dt, posture, x.joints, p)
        if moving:
            now = Situation(
                posture, x.joints, seen.steady, goal, p, x.dt, share, x.applied, frames,
                seen.cloud, seen.memory, wish,
            )  # fmt: skip
            command = mind.update(now, self._guard.unseen)
            if wish is not None:
                self._granted = granted(
                    wish, command, posture, seen.steady, self.robot, p.joint_speed
                )
        else:
            command = mind.brake(x.joints, x.dt, x.applied)
        if not np.isfinite(command.qd).all():
            raise FlinchError("the controller asked for a joint velocity that is not finite")
        lap("control")
        return self._outputs(x, seen, command, engage)

    def _blindly(self, x: Inputs, trace: str) -> Outputs:
        """A tick that failed: brake, with what was believed before."""
        self._granted = None
        joints = JointState(x.joints.stamp, self._q, np.zeros(self.robot.n))
        seen = self._perception.recall(joints, self.params)
        command = self._controllers.brake(joints, x.dt, x.applied)
        return self._outputs(x, seen, command, engage=False, trace=trace)

    def _outputs(
        self, x: Inputs, seen: Percept, command: Command, engage: bool, trace: str = ""
    ) -> Outputs:
        errand, guard, health = self.wishes.errand, self._guard, self._guard.health
        goal = errand.goal or Goal(seen.posture.T_base_tool)
        return Outputs(
            command=command, engage=engage, status=guard.status, params=self.params,
            goal=goal, T_base_link=seen.posture.T_base_link, T_base_tool=seen.posture.T_base_tool,
            cloud=seen.cloud, pairs=seen.pairs, body=seen.body, memory=seen.memory,
            health=freeze(health.states(x.now)),
            rate=freeze(health.rates()), delay=freeze(health.delays()),
            background=self._perception.background.view(x.now),
            notice=self.wishes.notice,
            advice=x.arm.advice or guard.advice(command) or command.reason,
            program=errand.program.words if errand.program else "", reached=errand.reached,
            jump=self._jump(seen, command), trace=trace, blind=guard.blind_share,
            unable=guard.unable, granted=self._granted,
            nearness=self._nearness(x.now, seen, command, goal),
        )  # fmt: skip

    def _nearness(self, now: float, seen: Percept, command: Command, goal: Goal) -> Nearness:
        """Of the body's points, also where a controller looks at the sensors' mounts only."""
        mind = self._controllers
        mounts = mind.needs(self.params).pairs == "mounts"
        return nearness(
            seen.body if mounts else seen.pairs, seen.steady, command.control_row, seen.posture,
            self.robot.qd_max, goal, mind.blocked(now),
        )  # fmt: skip

    def _jump(self, seen: Percept, command: Command) -> float:
        """How far the control point has moved since the last tick [m]."""
        before, row = self._point, seen.steady.measured(command.control_row)
        self._point = seen.pairs.on_robot[row] if row >= 0 else None
        if before is None or self._point is None:
            return 0.0
        return float(np.linalg.norm(self._point - before))
