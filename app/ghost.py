"""A ghost: a second controller on a simulated arm of its own, in the same world, at the same time.

It has its own simulated skin, cloud and controller and the same goal, and touches nothing: two
controllers can be watched side by side. It doubles what the simulation and the tick cost. A
ghost that fails is left out with its reason; the arm goes on.
"""

import logging
from dataclasses import replace

import numpy as np

from app.cell.parts import Cell
from app.config import ControlMode, Params
from app.messages import Array, GhostState, Goal
from app.pipeline import Pipeline
from app.robot.arm import SimulatedArm
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.simulated import SimulatedSkin
from app.world.world import World

log = logging.getLogger(__name__)


class Ghost:
    """Steps with the engine; `update` once a tick."""

    def __init__(
        self, robot: Robot, skin: Skin, world: World, cell: Cell, mode: ControlMode, q: Array,
        seed: int = 0,
    ) -> None:  # fmt: skip
        self._robot, self._mode = robot, mode
        self._arm = SimulatedArm(robot, q)
        self._eye = SimulatedSkin(robot, skin, world, seed)
        self._pipeline = Pipeline(robot, skin, cell)
        self._fault = ""

    def update(
        self, goal: Goal, params: Params, now: float, dt: float, moving: bool
    ) -> GhostState | None:
        """One tick towards the arm's own goal; None once it has failed."""
        if self._fault:
            return None
        try:
            joints = self._arm.state(now)
            frames = self._eye.poll(now, self._robot.posture(joints.q))
            own = replace(params, mode=self._mode)
            outcome = self._pipeline.tick(frames, joints, goal, own, dt, moving)
            self._arm.send(outcome.command.qd, dt)
        except Exception as error:
            log.exception("the ghost failed and is left out")
            self._fault = repr(error)
            return None
        body = outcome.body
        near = float(np.min(body.distance, initial=np.inf))
        return GhostState(self._mode, outcome.posture.T_base_link, near, outcome.command)

    @property
    def fault(self) -> str:
        """Why it was left out; empty while it runs."""
        return self._fault
