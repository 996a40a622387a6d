"""A real skin, or a recorded one, with whatever arm: the world is not ours to change."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from app.actions import Action, SpoilSensor
from app.errors import SensorError
from app.messages import Array, BodyPose, JointState
from app.plant.plant import Arm, Reading, listen, nothing_to_edit
from app.robot.model import Robot
from app.robot.posture import Posture
from app.sensing.source import Source
from app.sensing.spoiled import OFF, WELL, SpoiledSkin


class RealPlant:
    """`source` speaks of the real world; `arm` may be real or simulated."""

    editable = False

    def __init__(self, robot: Robot, arm: Arm, source: Source) -> None:
        self.name, self.limits = source.name, arm.limits
        self._robot, self._arm = robot, arm
        self._spoiled = SpoiledSkin(source)
        self._source: Source = self._spoiled

    def listen_through(self, ear: Callable[[Source], Source]) -> None:
        """Let the frames come through what `ear` makes of their source: to try what may fail."""
        self._source = ear(self._source)

    def read(self, now: float, patience: float) -> Reading:
        joints = self._arm.state(now)
        frames, source = listen(self._source, now, self._posture(joints), patience)
        if self._spoiled.spoiled:
            source = replace(source, spoiled=self._spoiled.spoiled)
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
        if not isinstance(action, SpoilSensor):
            raise nothing_to_edit(action)
        if action.how not in (WELL, OFF) and self._is_real(action.sensor):
            raise SensorError(f"a real sensor cannot be {action.how}; it can only be switched off")
        self._spoiled.spoil(action.sensor, action.how)

    def _is_real(self, sensor: int) -> bool:
        """Do its frames come from a device, or were they recorded from one?"""
        return True

    def bodies(self) -> tuple[BodyPose, ...]:
        return ()

    def close(self) -> None:
        try:
            self._arm.close()
        finally:
            self._source.close()
