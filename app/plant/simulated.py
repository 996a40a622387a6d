"""A simulated world around the arm. Sensors, onlookers and judges look at it; no one else."""

import numpy as np

from app.actions import Action, AddObstacle, MoveObstacle, RemoveObstacle
from app.messages import BodyPose
from app.plant.plant import Arm, Reading, nothing_to_edit
from app.plant.real import RealPlant
from app.robot.model import Robot
from app.robot.posture import rigid
from app.sensing.source import Source
from app.world.world import World


class SimulatedPlant(RealPlant):
    """The same with a world that moves and that people may change; `eye` sees that world."""

    def __init__(
        self, robot: Robot, arm: Arm, eye: Source, world: World, look_every: float = 0.0
    ) -> None:
        """look_every: [s] between two looks of `bodies` at the world, which cost more than a
        tick's other onlookers: every tick for a judge, as often as a picture for a page."""
        super().__init__(robot, arm, eye)
        self.world = world
        self._look_every, self._looked, self._now = look_every, -np.inf, 0.0
        self._bodies: tuple[BodyPose, ...] = ()
        self._born: float | None = None  # [s] the world's scripts begin with the first reading

    def read(self, now: float, patience: float) -> Reading:
        self._born = now if self._born is None else self._born
        self._now = now
        self.world.step(now - self._born)
        return super().read(now, patience)

    def act(self, action: Action) -> None:
        match action:
            case AddObstacle() | RemoveObstacle():
                self.world.edit(action)
            case MoveObstacle(name=name, T_base_body=T):
                self.world.edit(MoveObstacle(name, rigid(T)))
            case _:
                raise nothing_to_edit(action)

    def bodies(self) -> tuple[BodyPose, ...]:
        if self._now >= self._looked + self._look_every:
            self._bodies, self._looked = self.world.poses(), self._now
        return self._bodies
