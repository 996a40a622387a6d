"""Simulated sensors: the only eye of the simulated robot.

Sensors are staggered over one period and their frames arrive `latency` later. The measurement
is what takes time; `app.sensing.simulated_apart` has it done in another process.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from app.messages import SensorFrame
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.budget import IDEAL, Budget
from app.sensing.error_model import ErrorModel, Reading
from app.sensing.measurement import Measurement
from app.sensing.schedule import EARLY, LATENCY, Schedule
from app.sensing.sight import eyes_of
from app.sensing.source import Unfailing
from app.sensing.stamps import Stamps
from app.sensing.truth import draw_truth
from app.world.world import World


class SimulatedSkin(Unfailing):
    """Frames of every sensor of `skin` on `robot` in `world`, seeded.

    robot, skin: as they are laid out.   budget: how far the `truth` is from that.
    """

    def __init__(
        self,
        robot: Robot,
        skin: Skin,
        world: World,
        seed: int = 0,
        errors: ErrorModel | None = None,
        latency: float = LATENCY,
        budget: Budget = IDEAL,
    ) -> None:
        self.truth = draw_truth(robot, skin, budget, seed)
        self.name = "simulated"
        self.connected: NDArray[np.bool_] = np.ones(skin.count, dtype=bool)
        self.muted: set[int] = set()  # sensors that have gone silent, for trying faults
        errors = errors or ErrorModel()
        self._measurement = Measurement(eyes_of(self.truth), world, seed, errors)
        self._schedule = Schedule([s.type.period for s in skin.sensors])
        self._stamps = Stamps(self.truth, latency)
        self._on_the_way: deque[SensorFrame] = deque()

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Measure with the sensors that are due, return the frames that have arrived.

        posture: of the true robot.
        """
        due = [k for k in self._schedule.due(now) if k not in self.muted]
        if due:
            self._on_the_way.extend(self._measurement.frames(due, posture.T_base_link, now))
        arrived = []
        while self._on_the_way and self._on_the_way[0].stamp + self._stamps.delay <= now + EARLY:
            arrived.append(self._stamps.stamped(self._on_the_way.popleft()))
        return arrived

    def ended(self) -> str:
        """A simulation never ends by itself."""
        return ""

    def read(self, k: int, posture: Posture) -> Reading:
        """The truth in each zone of sensor k, for judging filters."""
        return self._measurement.read([k], posture.T_base_link)[0]
