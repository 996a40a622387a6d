"""Simulated sensors: the only eye of the simulated robot.

Sensors are staggered over one period and their frames arrive `latency` later. `Measurement` is
what takes time and may be done elsewhere (`app.sensing.simulated_apart`); when a sensor measures
and when its frame arrives is decided where the arm is.
"""

from collections import deque
from collections.abc import Sequence
from math import floor

import numpy as np
from numpy.typing import NDArray

from app.messages import SLOTS, Array, SensorFrame, freeze
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.error_model import ErrorModel, Reading
from app.sensing.sight import FAR, Links, Sight, links_of
from app.sensing.source import Unfailing
from app.sensing.streams import sensor_streams
from app.world.world import World

RATE = 15.0  # [Hz] the fastest for 8x8 (UM3109)
LATENCY = 0.05  # [s] from measurement to the host
EARLY = 1e-9  # [s] that rounding may make a time late


class Schedule:
    """When each of `count` sensors measures: at RATE, staggered evenly over one period."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._next: Array | None = None

    def due(self, now: float) -> list[int]:
        """The sensors that measure now."""
        period = 1.0 / RATE
        if self._next is None:
            self._next = now + period * np.arange(self._count) / self._count
        due: list[int] = np.flatnonzero(self._next <= now + EARLY).tolist()
        for k in due:
            # a sensor keeps its rhythm: what a stall has swallowed is not sent in a burst
            self._next[k] += period * (floor((now - self._next[k]) / period + 1e-6) + 1.0)
        return due


class Measurement:
    """Frames of any sensors of `skin` at any time: what is there, and what the sensor makes of it.

    A frame depends on the seed, the sensor and the number of its frame, and on what is there.
    """

    def __init__(
        self, links: Links, skin: Skin, world: World, seed: int, errors: ErrorModel
    ) -> None:
        self._sight, self._errors = Sight(links, skin, world), errors
        self._streams = [sensor_streams(seed, k) for k in range(skin.count)]
        self._bias = [errors.bias(streams) for streams in self._streams]
        self._range = [errors.range_90(s.resolution) for s in skin.sensors]
        self._sequence = [0] * skin.count
        self._had_target = np.zeros((skin.count, SLOTS), dtype=bool)

    def read(self, sensors: Sequence[int], T_base_link: Array) -> list[Reading]:
        """The truth in each zone of some sensors, links posed at T_base_link (L, 4, 4)."""
        return self._sight.read(sensors, T_base_link)

    def frames(self, sensors: Sequence[int], T_base_link: Array, now: float) -> list[SensorFrame]:
        """The next frame of each of some sensors, measured at `now` [s]."""
        readings = self.read(sensors, T_base_link)
        return [self._frame(k, r, now) for k, r in zip(sensors, readings, strict=True)]

    def _frame(self, k: int, reading: Reading, now: float) -> SensorFrame:
        distance, status, targets = self._errors.measure(
            reading, FAR, self._range[k], self._bias[k], self._had_target[k],
            self._sequence[k] == 0, self._streams[k],
        )  # fmt: skip
        self._sequence[k] += 1
        return SensorFrame(
            sensor=k,
            stamp=now,
            sequence=self._sequence[k],
            distance=freeze(distance),
            status=freeze(status),
            targets=freeze(targets),
        )


class SimulatedSkin(Unfailing):
    """Frames of every sensor of `skin` on `robot` in `world`, seeded."""

    def __init__(
        self,
        robot: Robot,
        skin: Skin,
        world: World,
        seed: int = 0,
        errors: ErrorModel | None = None,
        latency: float = LATENCY,
    ) -> None:
        self.name = "simulated"
        self.connected: NDArray[np.bool_] = np.ones(skin.count, dtype=bool)
        self.muted: set[int] = set()  # sensors that have gone silent, for trying faults
        self._measurement = Measurement(links_of(robot), skin, world, seed, errors or ErrorModel())
        self._schedule, self._latency = Schedule(skin.count), latency
        self._on_the_way: deque[SensorFrame] = deque()

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Measure with the sensors that are due, return the frames that have arrived."""
        due = [k for k in self._schedule.due(now) if k not in self.muted]
        if due:
            self._on_the_way.extend(self._measurement.frames(due, posture.T_base_link, now))
        arrived = []
        while self._on_the_way and self._on_the_way[0].stamp + self._latency <= now + EARLY:
            arrived.append(self._on_the_way.popleft())
        return arrived

    def ended(self) -> str:
        """A simulation never ends by itself."""
        return ""

    def read(self, k: int, posture: Posture) -> Reading:
        """The truth in each zone of sensor k, for judging filters."""
        return self._measurement.read([k], posture.T_base_link)[0]
