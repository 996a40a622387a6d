"""Some sensors real, the rest simulated; a person may switch each of them."""

from dataclasses import replace

from app.actions import Action, UseSensor
from app.plant.plant import Arm, Reading
from app.plant.simulated import SimulatedPlant
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.mixed import MixedSkin
from app.world.world import World


class MixedPlant(SimulatedPlant):
    """The simulated world is seen by the sensors that no port speaks for."""

    def __init__(
        self, robot: Robot, arm: Arm, eye: MixedSkin, world: World, skin: Skin,
        look_every: float = 0.0,
    ) -> None:  # fmt: skip
        super().__init__(robot, arm, eye, world, look_every)
        self._eye, self._skin = eye, skin

    def read(self, now: float, patience: float) -> Reading:
        reading = super().read(now, patience)
        return replace(reading, source=replace(reading.source, real=self._eye.real))

    def act(self, action: Action) -> None:
        if isinstance(action, UseSensor):
            self._eye.use(self._skin.index(action.sensor), action.real)
        else:
            super().act(action)

    def _is_real(self, sensor: int) -> bool:
        real = self._eye.real
        return 0 <= sensor < len(real) and bool(real[sensor])
