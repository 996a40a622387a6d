"""A skin of which some sensors fail: the frames of another source, spoiled on their way."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, SensorFrame, freeze
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.source import Source

SUN, NO_USE = 13, 4  # statuses that no type trusts
KINDS = {
    "dead": "sends nothing",
    "frozen": "repeats its last frame",
    "sun": f"status {SUN} in every zone",
    "covered": "a sticker on the window: 8 mm in every zone",
    "black": "something black on the window: no return in any zone",
    "half": f"status {NO_USE} in half of its zones",
}


class FaultySkin:
    """`inner`, with a `kind` of fault of the sensors that are in `failed`."""

    def __init__(self, inner: Source, skin: Skin, kind: str, seed: int = 0) -> None:
        self.name, self.failed = inner.name, set[int]()
        self._inner, self._skin, self._kind = inner, skin, kind
        self._rng = np.random.default_rng([seed, 13])
        zones = [s.type.zones for s in skin.sensors]
        self._half = [self._rng.permutation(n) < n // 2 for n in zones]
        self._last: dict[int, SensorFrame] = {}

    @property
    def connected(self) -> NDArray[np.bool_]:
        return self._inner.connected

    def fail(self, sensors: Collection[int]) -> None:
        """From the next frame on these fail."""
        self.failed = set(sensors)

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        frames = []
        for f in self._inner.poll(now, posture):
            if f.sensor not in self.failed:
                self._last[f.sensor] = f
                frames.append(f)
            elif self._kind != "dead":
                frames.append(self._spoiled(f))
        return frames

    def _spoiled(self, f: SensorFrame) -> SensorFrame:
        codes, n = self._skin.sensors[f.sensor].type.status, len(f.status)
        if self._kind == "frozen":
            last = self._last.get(f.sensor, f)
            self._last[f.sensor] = last
            return replace(last, stamp=f.stamp, sequence=f.sequence)
        if self._kind == "sun":
            return replace(f, status=_all(n, SUN))
        if self._kind == "half":
            half = self._half[f.sensor]
            return replace(f, status=freeze(np.where(half, NO_USE, f.status).astype(np.uint8)))
        if self._kind == "black":
            return replace(f, status=_all(n, codes.no_target), targets=_all(n, 0))
        near: Array = np.rint(8.0 + self._rng.standard_normal(n)) / 1000.0
        return replace(f, distance=freeze(near), status=_all(n, codes.valid), targets=_all(n, 1))

    def ended(self) -> str:
        return self._inner.ended()

    def fault(self, now: float, silence: float, used: NDArray[np.bool_]) -> str:
        return self._inner.fault(now, silence, used)

    def inputs(self, now: float) -> tuple[tuple[str, str], ...]:
        return self._inner.inputs(now)

    def close(self) -> None:
        self._inner.close()


def _all(zones: int, value: int) -> NDArray[np.uint8]:
    return freeze(np.full(zones, value, dtype=np.uint8))
