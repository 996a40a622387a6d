"""What people have asked of the arm: a goal, a program, to stay, or to be moved by hand."""

from collections.abc import Mapping

import numpy as np

from app.actions import GoHome, Jog, JogJoints, RunProgram, RunTaught, SetGoal, SetPose, Want
from app.config import Params
from app.control.jogging import RAMP, Jogging, homeward
from app.control.programs import Program, ProgramRun, taught
from app.errors import ConfigError, options
from app.granted import Wish
from app.messages import Array, Goal, JointState, Mode, freeze
from app.poses import transform
from app.robot.model import Robot
from app.robot.posture import Posture, rigid

Goals = SetGoal | SetPose | RunProgram | RunTaught | GoHome
GENTLY = 0.05  # share of the speed with which the way home begins


class Errand:
    """The goal of each tick; `goal` None until one was given or the arm has been seen."""

    def __init__(self, robot: Robot, programs: Mapping[str, Program], goal: Goal | None) -> None:
        self._robot, self.programs = robot, dict(programs)
        self._jogging = Jogging(robot)
        self._home = 0.0  # share of the speed on the way home, which the joints take; 0: none
        self.goal, self.held = goal, goal
        self.program: ProgramRun | None = None

    @property
    def reached(self) -> int:
        """Waypoints reached by the program that runs, 0 without one."""
        return self.program.reached if self.program else 0

    def hold(self, T_base_tool: Array) -> None:
        """Stay here from now on while holding; without a goal this is also the goal."""
        self.held = Goal(freeze(T_base_tool.copy()))
        self.goal = self.goal or self.held

    @property
    def by_hand(self) -> bool:
        """Is the arm moved by hand, or coming to rest after it?"""
        return self._jogging.active

    def jog(self, action: Jog | JogJoints | Want, now: float) -> None:
        """Be moved by hand for a moment; where that ends is the goal. Raises as `Jogging.ask`."""
        self._jogging.ask(action, now)
        if self._jogging.active:
            self.program, self._home = None, 0.0

    def leave_alone(self) -> None:
        """Nobody moves the arm by hand any more, and the way home begins gently."""
        self._jogging.reset()
        self._home = min(self._home, GENTLY)

    def take(self, action: Goals, T_base_tool: Array) -> None:
        """A new goal or program; raises FlinchError or ValueError and changes nothing then."""
        goal, program = self.goal, self.program
        self._take(action, T_base_tool)
        if self.goal is not goal or self.program is not program:
            self._jogging.reset()
            self._home = GENTLY if isinstance(action, GoHome) else 0.0

    def _take(self, action: Goals, T_base_tool: Array) -> None:
        match action:
            case GoHome():
                T = self._robot.posture(self._robot.home).T_base_tool
                self.goal, self.program = Goal(freeze(T.copy())), None
            case SetGoal(T_base_tool=T):
                self.goal, self.program = Goal(freeze(rigid(T))), None
            case SetPose(position=position, rpy=rpy):
                T = rigid(transform(np.array(position), np.array(rpy)))
                self.goal, self.program = Goal(freeze(T)), None
            case RunTaught(name=name, places=places):
                self.programs[name] = taught(name, places)
                self.program = ProgramRun(self.programs[name], T_base_tool.copy())
            case RunProgram(name=""):
                self.program = None  # it rests at the present goal
            case RunProgram(name=name):
                if name not in self.programs:
                    raise ConfigError(f"no program {name!r}; {options(name, self.programs)}")
                self.program = ProgramRun(self.programs[name], T_base_tool.copy())

    def update(self, mode: Mode, moving: bool, T_base_tool: Array, dt: float) -> Goal | None:
        """The goal for the next `dt` [s], with the tool where it is; None while moved by hand."""
        if self._jogging.active:
            self.goal = self.held = Goal(freeze(T_base_tool.copy()))
            return None
        if mode is not Mode.RUNNING:
            return self.held
        if self.program and moving:
            self.goal = self.program.update(T_base_tool, dt)
        return self.goal

    def wish(
        self, mode: Mode, moving: bool, now: float, dt: float, posture: Posture,
        joints: JointState, params: Params,
    ) -> Wish | None:  # fmt: skip
        """The velocity for the next `dt` [s] that goes before the goal; None: there is none."""
        if not moving:
            self._jogging.reset()
            return None
        if self._jogging.active:
            return self._jogging.update(now, dt, posture, joints, params)
        if not self._home or mode is not Mode.RUNNING:
            return None
        wish = homeward(self._robot, posture, params, self._home)
        self._home = min(1.0, self._home + dt / RAMP) if wish else 0.0
        return wish
