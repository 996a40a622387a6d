"""Sensors that a person spoils from the page, to see what the arm makes of it.

A sensor that is off sends nothing; so it is missed like one that is unplugged, and its space
counts as unseen. A frozen one repeats one frame with new stamps; a noisy one adds to what it sees.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from app.errors import SensorError, options
from app.messages import SensorFrame, freeze
from app.robot.posture import Posture
from app.sensing.source import Source

WELL, OFF, FROZEN, NOISY = "as it is", "off", "frozen", "noisy"
HOW: Mapping[str, str] = MappingProxyType(
    {
        WELL: "nothing is done to it",
        OFF: "sends nothing: what it should see counts as unseen",
        FROZEN: "repeats its next frame for ever",
        NOISY: "5 cm of noise on every distance",
    }
)
NOISE = 0.05  # [m] ten times what a sensor has at half a metre: nobody overlooks it


class SpoiledSkin:
    """`inner`, with what is done to some of its sensors."""

    def __init__(self, inner: Source, seed: int = 0) -> None:
        self.name = inner.name
        self._inner, self._rng = inner, np.random.default_rng([seed, 17])
        self._how: dict[int, str] = {}
        self._held: dict[int, SensorFrame] = {}  # of the frozen ones

    @property
    def spoiled(self) -> tuple[tuple[int, str], ...]:
        """The sensors to which something is done, by index, and what."""
        return tuple(sorted(self._how.items()))

    def spoil(self, k: int, how: str) -> None:
        """From the next frame on do this to sensor k; SensorError for one that there is not."""
        if not 0 <= k < len(self._inner.connected):
            raise SensorError(f"there is no sensor {k}; give 0 to {len(self._inner.connected) - 1}")
        if how not in HOW:
            raise SensorError(f"a sensor cannot be {how!r}; {options(how, HOW)}")
        self._held.pop(k, None)
        self._how.pop(k, None)
        if how != WELL:
            self._how[k] = how

    @property
    def connected(self) -> NDArray[np.bool_]:
        return self._inner.connected

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        frames = self._inner.poll(now, posture)
        if not self._how:
            return frames
        return [self._done(f) for f in frames if self._how.get(f.sensor) != OFF]

    def _done(self, f: SensorFrame) -> SensorFrame:
        how = self._how.get(f.sensor)
        if how == FROZEN:
            held = self._held.setdefault(f.sensor, f)
            return replace(held, stamp=f.stamp, sequence=f.sequence)
        if how == NOISY:
            noise = NOISE * self._rng.standard_normal(len(f.distance))
            return replace(f, distance=freeze(np.maximum(f.distance + noise, 0.0)))
        return f

    def ended(self) -> str:
        return self._inner.ended()

    def fault(self, now: float, silence: float, used: NDArray[np.bool_]) -> str:
        return self._inner.fault(now, silence, used)

    def inputs(self, now: float) -> tuple[tuple[str, str], ...]:
        return self._inner.inputs(now)

    def close(self) -> None:
        self._inner.close()
