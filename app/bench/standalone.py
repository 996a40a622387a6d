"""A controller without perception or program: what it asks for is what the arm is told."""

from typing import Protocol

from app.cell.parts import Cell
from app.config import Params
from app.control.clearance import Clearance
from app.control.controller import Situation
from app.control.registry import kind_of
from app.messages import Array, Command, Goal, JointState, Pairs
from app.robot.model import Robot
from app.robot.posture import Posture


class Moment(Protocol):
    """What a controller is asked about."""

    @property
    def posture(self) -> Posture: ...
    @property
    def joints(self) -> JointState: ...
    @property
    def pairs(self) -> Pairs: ...
    @property
    def goal(self) -> Goal: ...


class Standalone:
    """The controller of a mode; pairs are given to it as they are."""

    def __init__(self, robot: Robot, mode: str) -> None:
        self._robot = robot
        self._control = kind_of(mode).make(robot, Clearance(robot, Cell()))
        self.reset()

    def reset(self) -> None:
        """Begin at rest."""
        self._control.reset()
        self.rest()

    def rest(self) -> None:
        """The arm was told to stand, whatever the controller remembers."""
        self.previous: Array = 0.0 * self._robot.home

    def step(self, m: Moment, params: Params, dt: float) -> Command:
        """The next command."""
        now = Situation(m.posture, m.joints, m.pairs, m.goal, params, dt, 1.0, self.previous)
        command = self._control.update(now)
        self.previous = command.qd
        return command
