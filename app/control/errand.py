"""What people have asked the arm to do: a goal, a waypoint program, or to stay where it is."""

from collections.abc import Mapping

import numpy as np

from app.actions import RunProgram, SetGoal, SetPose
from app.control.programs import Program, ProgramRun
from app.errors import ConfigError, options
from app.messages import Array, Goal, Mode, freeze
from app.poses import transform
from app.robot.posture import rigid


class Errand:
    """The goal of each tick; `goal` None until one was given or the arm has been seen."""

    def __init__(self, programs: Mapping[str, Program], goal: Goal | None) -> None:
        self.programs = dict(programs)
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

    def take(self, action: SetGoal | SetPose | RunProgram, T_base_tool: Array) -> None:
        """A new goal or program; raises FlinchError or ValueError and changes nothing then."""
        match action:
            case SetGoal(T_base_tool=T):
                self.goal, self.program = Goal(freeze(rigid(T))), None
            case SetPose(position=position, rpy=rpy):
                T = rigid(transform(np.array(position), np.array(rpy)))
                self.goal, self.program = Goal(freeze(T)), None
            case RunProgram(name=""):
                self.program = None  # it rests at the present goal
            case RunProgram(name=name):
                if name not in self.programs:
                    raise ConfigError(f"no program {name!r}; {options(name, self.programs)}")
                self.program = ProgramRun(self.programs[name], T_base_tool.copy())

    def update(self, mode: Mode, moving: bool, T_base_tool: Array, dt: float) -> Goal | None:
        """The goal for the next `dt` [s], with the tool where it is."""
        if mode is not Mode.RUNNING:
            return self.held
        if self.program and moving:
            self.goal = self.program.update(T_base_tool, dt)
        return self.goal
