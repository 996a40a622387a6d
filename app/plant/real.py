"""A real skin, or a recorded one, with whatever arm: the world is not ours to change."""

from collections.abc import Callable

import numpy as np

from app.actions import Action
from app.messages import Array, BodyPose, JointState
from app.plant.plant import Arm, Reading, listen, nothing_to_edit
from app.robot.model import Robot
from app.robot.posture import Posture
from app.sensing.source import Source


class RealPlant:
    """`source` speaks of the real world; `arm` may be real or simulated."""

    def __init__(self, robot: Robot, arm: Arm, source: Source) -> None:
        self.name, self.limits = source.name, arm.limits
        self._robot, self._arm, self._source = robot, arm, source

    def listen_through(self, ear: Callable[[Source], Source]) -> None:
        """Let the frames come through what `ear` makes of their source: to try what may fail."""
        self._source = ear(self._source)

    def read(self, now: float, patience: float) -> Reading:
        joints = self._arm.state(now)
        frames, source = listen(self._source, now, self._posture(joints), patience)
        report = self._arm.report(now)
        return Reading(joints, self._arm.applied(now), report, frames, source)

    def _posture(self, joints: JointState) -> Posture:
        """Where the skin is: as the joints say, at home while they say nothing."""
        return self._robot.posture(joints.q if np.isfinite(joints.q).all() else self._robot.home)

    def send(self, qd: Array, dt: float) -> Array:
        return self._arm.send(qd, dt)

    def engage(self) -> None:
        self._arm.engage()

    def act(self, action: Action) -> None:
        raise nothing_to_edit(action)

    def bodies(self) -> tuple[BodyPose, ...]:
        return ()

    def close(self) -> None:
        try:
            self._arm.close()
        finally:
            self._source.close()
