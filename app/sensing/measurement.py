"""What simulated sensors report: what is there, and what a sensor makes of it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.messages import Array, SensorFrame, freeze
from app.sensing.error_model import ErrorModel, Reading
from app.sensing.sight import Eyes, Sight
from app.sensing.streams import sensor_streams
from app.world.world import World

LIGHT = 0.5  # [klux] of a laboratory, at strength 1


class Measurement:
    """Frames of any of the sensors at any time: what is there, and what the sensor makes of it.

    A frame depends on the seed, the sensor and the number of its frame, and on what is there.
    """

    def __init__(self, eyes: Eyes, world: World, seed: int, errors: ErrorModel) -> None:
        budget, skin = eyes.budget, eyes.skin
        light = errors.light_klux + LIGHT * budget.light
        errors = replace(errors, light_klux=light, by_signal=budget.ranges)
        self._sight, self._errors = Sight(eyes, world), errors
        kinds = [s.type for s in skin.sensors]
        self._streams = [sensor_streams(seed, k) for k in range(skin.count)]
        self._flaws = [
            errors.flaws(t, s, w)
            for t, s, w in zip(kinds, self._streams, self._sight.window, strict=True)
        ]
        self._sequence = [0] * skin.count
        self._had_target = [np.zeros(t.zones, dtype=bool) for t in kinds]

    def read(self, sensors: Sequence[int], T_base_link: Array) -> list[Reading]:
        """The truth in each zone of some sensors, links posed at T_base_link (L, 4, 4)."""
        return self._sight.read(sensors, T_base_link)

    def frames(self, sensors: Sequence[int], T_base_link: Array, now: float) -> list[SensorFrame]:
        """The next frame of each of some sensors, measured at `now` [s]."""
        readings = self.read(sensors, T_base_link)
        return [self._frame(k, r, now) for k, r in zip(sensors, readings, strict=True)]

    def _frame(self, k: int, reading: Reading, now: float) -> SensorFrame:
        said = self._errors.measure(
            reading, self._flaws[k], self._had_target[k], self._sequence[k] == 0, self._streams[k]
        )
        self._sequence[k] += 1
        return SensorFrame(
            sensor=k,
            stamp=now,
            sequence=self._sequence[k],
            distance=freeze(said.distance),
            status=freeze(said.status),
            targets=freeze(said.targets),
        )
