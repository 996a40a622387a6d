"""All controllers by mode, and the one that is in force.

Which pairs a controller works with is its own fact: the sensors' mounting points, the closest
point of every link, or several points a link.
"""

from dataclasses import replace
from typing import Literal

from app.cell.learned import Learned
from app.cell.parts import Cell
from app.config import ControlMode, Params
from app.control.avoidance import Avoidance
from app.control.keep_out import KeepOut
from app.control.separation import in_use
from app.control.stuck import Stuck
from app.control.whole_body import WholeBody
from app.messages import Array, Command, Goal, JointState, Pairs, freeze
from app.robot.model import Robot
from app.robot.posture import Posture

AT_THE_CELL = "held off the known cell"


class Controllers:
    """One command a tick by the controller of `params.mode`; it takes over what is in force."""

    def __init__(self, robot: Robot, cell: Cell) -> None:
        bounds = WholeBody(robot, cell)
        self._bounds = bounds
        self._by_mode: dict[ControlMode, Avoidance | WholeBody] = {
            "wb": Avoidance(robot),
            "sm": Avoidance(robot),  # its own: a row that is held on to is a sensor's, not a link's
            "multi": Avoidance(robot, "links"),
            "qp": bounds,
            "ssm": bounds,
        }
        self._keep_out = KeepOut(robot, bounds.bounds)
        self._stuck = Stuck()
        self.reset()

    def reset(self, previous: Array | None = None) -> None:
        """Begin from rest, or from the velocity `previous` (n,) that is in force."""
        self._in_force: Avoidance | WholeBody = self._bounds
        for controller in self._by_mode.values():
            controller.reset(previous)
        self._stuck.reset()

    def know(self, learned: Learned) -> None:
        """From now on this is what was learned of the cell."""
        self._bounds.bounds.know(learned)

    def kind(self, params: Params) -> Literal["mounts", "links", "several"]:
        """Which pairs the controller in these settings works with."""
        if params.mode == "sm":
            return "mounts"
        several = params.many_pairs and self._by_mode[params.mode] is self._bounds
        return "several" if several else "links"

    def wants_ages(self, params: Params) -> bool:
        """Does it ask how old a measurement is?"""
        return in_use(params)

    def update(
        self,
        posture: Posture,
        joints: JointState,
        pairs: Pairs,
        goal: Goal | None,
        params: Params,
        dt: float,
        share: float,
        applied: Array,
    ) -> Command:
        """The next command; `goal` None means: rest where you are, but give way.

        share: 0..1 of the allowed speed.   applied: (n,) [rad/s] what the arm was really told.
        """
        control = self._chosen(params.mode, applied)
        tool, now = posture.T_base_tool, joints.stamp
        goal = self._stuck.goal(goal, tool, now)
        command = control.update(posture, joints, pairs, goal, params, dt, pairs.approach, share)
        if control is not self._bounds:
            qd = self._keep_out.allowed(command.qd, posture, joints, params, applied, dt)
            if qd is not command.qd:
                command = replace(command, qd=freeze(qd), reason=command.reason or AT_THE_CELL)
        self._stuck.see(tool, pairs, command, params.escape, now)
        if self._stuck.words and not command.reason:
            command = replace(command, reason=self._stuck.words)
        return command

    def brake(self, joints: JointState, dt: float, applied: Array) -> Command:
        """As fast to rest as the limits allow; what was followed before is forgotten.

        Otherwise an arm that is set going again would give way to what left long ago.
        """
        self._in_force.previous = applied.copy()
        command = self._in_force.brake(joints, dt)
        self._in_force.reset(command.qd.copy())
        self._stuck.reset()
        return command

    def _chosen(self, mode: ControlMode, applied: Array) -> Avoidance | WholeBody:
        """The controller of this mode; another one goes on from what is in force."""
        chosen = self._by_mode[mode]
        if chosen is not self._in_force:
            chosen.reset(applied.copy())
            self._in_force = chosen
        chosen.previous = applied.copy()
        return chosen
