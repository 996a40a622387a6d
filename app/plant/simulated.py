"""A simulated world around the arm. Sensors, onlookers and judges look at it; no one else.

The robot of such a plant is the true one: its joints and links lie where they are, which is not
quite where the brain believes them.
"""

import numpy as np

from app.actions import (
    Action,
    AddObstacle,
    MoveObstacle,
    PauseWorld,
    RemoveObstacle,
    SetPerson,
    StepWorld,
)
from app.messages import Array, BodyPose, JointState
from app.plant.plant import Arm, Reading
from app.plant.real import RealPlant
from app.robot.arm import SimulatedArm
from app.robot.model import Robot
from app.robot.posture import Posture, rigid
from app.sensing.source import Source
from app.world.entries import person_called
from app.world.world import Exchange, World


class SimulatedPlant(RealPlant):
    """The same with a world that moves and that people may change; `eye` sees that world."""

    editable = True

    def __init__(
        self, robot: Robot, arm: Arm, eye: Source, world: World, look_every: float = 0.0
    ) -> None:
        """robot: the true one.

        look_every: [s] between two looks of `bodies` at the world, which cost more than a
        tick's other onlookers: every tick for a judge, as often as a picture for a page."""
        super().__init__(robot, arm, eye)
        self.robot, self.world = robot, world
        self._there = robot.posture(robot.home)  # of the last reading
        self._look_every, self._looked, self._now = look_every, -np.inf, 0.0
        self._bodies: tuple[BodyPose, ...] = ()
        self._born: float | None = None  # [s] the world's scripts begin with the first reading

    def read(self, now: float, patience: float) -> Reading:
        self._born = now if self._born is None else self._born
        self._now = now
        self.world.step(now - self._born)
        return super().read(now, patience)

    def true_poses(self) -> Array:
        """(L, 4, 4) where the body links of `robot` truly were at the last reading."""
        return self._there.T_base_link

    def _posture(self, joints: JointState) -> Posture:
        arm = self._arm
        if isinstance(arm, SimulatedArm):
            self._there = self._robot.posture(arm.q)
        else:
            self._there = super()._posture(joints)
        return self._there

    def act(self, action: Action) -> None:
        match action:
            case AddObstacle() | RemoveObstacle():
                self.world.edit(action)
            case MoveObstacle(name=name, T_base_body=T):
                self.world.edit(MoveObstacle(name, rigid(T)))
            case SetPerson(who=who):
                self.world.exchange(Exchange(self.world.people, person_called(who)))
            case PauseWorld(paused=paused):
                self.world.pause(paused)
            case StepWorld(seconds=seconds):
                self.world.skip(seconds)
            case _:
                super().act(action)

    def _is_real(self, sensor: int) -> bool:
        return False

    def bodies(self) -> tuple[BodyPose, ...]:
        if self._now >= self._looked + self._look_every:
            self._bodies, self._looked = self.world.poses(), self._now
        return self._bodies
