"""A simulated world around the arm. Sensors, onlookers and judges look at it; no one else."""

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

    def __init__(self, robot: Robot, arm: Arm, eye: Source, world: World) -> None:
        super().__init__(robot, arm, eye)
        self.world = world
        self._born: float | None = None  # [s] the world's scripts begin with the first reading

    def read(self, now: float, patience: float) -> Reading:
        self._born = now if self._born is None else self._born
        self.world.step(now - self._born)
        return super().read(now, patience)

    def act(self, action: Action) -> None:
        match action:
            case AddObstacle(name=name, shape=shape, position=position):
                self.world.add(name, shape, position)
            case MoveObstacle(name=name, T_base_body=T):
                self.world.move(name, rigid(T))
            case RemoveObstacle(name=name):
                self.world.remove(name)
            case _:
                raise nothing_to_edit(action)

    def bodies(self) -> tuple[BodyPose, ...]:
        return self.world.poses()
