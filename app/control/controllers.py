"""All controllers by name, and the one that is in force."""

from dataclasses import replace

import numpy as np

from app.cell.learned import Learned
from app.cell.parts import Cell
from app.config import Params
from app.control.clearance import Clearance
from app.control.controller import Controller, Situation
from app.control.keep_out import KeepOut
from app.control.limits import MARGIN, braked
from app.control.registry import kinds
from app.control.stuck import Stuck
from app.control.unseen import NOTHING_UNSEEN, Unseen, UnseenLimit
from app.messages import Array, Command, JointState, freeze
from app.needs import Needs
from app.robot.model import Robot

END = 1.5 * MARGIN  # [rad or m] before the end of its range a joint is held
AT_THE_CELL = "held off the known cell"


class Controllers:
    """One command a tick by the controller of `params.mode`; it takes over what is in force."""

    def __init__(self, robot: Robot, cell: Cell) -> None:
        self._robot = robot
        self._clearance = Clearance(robot, cell)
        self._kinds = dict(kinds())
        self._by_mode: dict[str, Controller] = {
            name: kind.make(robot, self._clearance) for name, kind in self._kinds.items()
        }
        self._keep_out = KeepOut(robot, self._clearance)
        self._unseen = UnseenLimit(robot, self._clearance.pieces)
        self._stuck = Stuck()
        self.reset()

    def reset(self) -> None:
        """Begin anew."""
        self._in_force = ""
        for controller in self._by_mode.values():
            controller.reset()
        self._stuck.reset()

    def know(self, learned: Learned) -> None:
        """From now on this is what was learned of the cell."""
        self._clearance.know(learned)

    def needs(self, params: Params) -> Needs:
        """What the controller in these settings wants of perception."""
        return self._kinds[params.mode].needs(params)

    def update(self, now: Situation, unseen: Unseen = NOTHING_UNSEEN) -> Command:
        """The next command, not faster towards what is `unseen` than the arm can stop."""
        control = self._chosen(now.params.mode)
        tool, stamp = now.posture.T_base_tool, now.joints.stamp
        goal = self._stuck.goal(now.goal, tool, stamp)
        # whoever goes a way round lets the straight one home be
        now = now._replace(goal=goal, wish=now.wish if goal is now.goal else None)
        command = control.update(now)
        if not self._kinds[now.params.mode].knows_cell:
            qd = self._keep_out.allowed(command.qd, now)
            if qd is not command.qd:
                command = replace(command, qd=freeze(qd), reason=command.reason or AT_THE_CELL)
        self._stuck.see(tool, now.pairs, command, now.params.way_round, stamp, self._ends(now))
        if self._stuck.words and not command.reason:
            command = replace(command, reason=self._stuck.words)
        command = self._unseen.slowed(command, now, unseen)
        return replace(command, qd=self._geared(command.qd))

    def blocked(self, now: float) -> float:
        """[s] for how long the tool has come no nearer to its goal; 0 while it does."""
        return self._stuck.blocked(now)

    def brake(self, joints: JointState, dt: float, applied: Array) -> Command:
        """As fast to rest as the limits allow; what was followed before is forgotten.

        Otherwise an arm that is set going again would give way to what left long ago.
        """
        if self._in_force:
            self._by_mode[self._in_force].reset()
        self._stuck.reset()
        return Command(qd=self._geared(braked(self._robot, joints.q, dt, applied)))

    def _ends(self, now: Situation) -> list[str]:
        """The joints that are at the ends of their ranges."""
        robot, q = self._robot, now.joints.q
        near = np.minimum(q - robot.q_min, robot.q_max - q) < END
        return [robot.joints[j] for j in np.flatnonzero(near)]

    def _geared(self, qd: Array) -> Array:
        """The velocities with those of the joints that follow another."""
        gears = self._robot.gears
        return freeze(qd if gears.own.all() else gears.speed(qd))

    def _chosen(self, mode: str) -> Controller:
        """The controller of this mode; another one goes on from what is in force."""
        if mode != self._in_force:
            self._by_mode[mode].reset()
            self._in_force = mode
        return self._by_mode[mode]
