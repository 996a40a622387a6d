"""Some sensors real, the others simulated; a person may switch each of them."""

import numpy as np
from numpy.typing import NDArray

from app.messages import SensorFrame
from app.robot.posture import Posture
from app.sensing.simulated import SimulatedSkin
from app.sensing.simulated_apart import SimulatedSkinApart
from app.sensing.source import Source
from app.sensing.truth import Truth


class MixedSkin:
    """Frames of `real` for the sensors that it speaks for, and of `simulated` for the rest."""

    def __init__(self, real: Source, simulated: SimulatedSkin | SimulatedSkinApart) -> None:
        self.name = f"{real.name}, the rest simulated"
        self._real, self._simulated = real, simulated
        self._chosen: dict[int, bool] = {}
        self.connected: NDArray[np.bool_] = simulated.connected

    @property
    def real(self) -> NDArray[np.bool_]:
        """(K,) sensors that are fed by the real skin: by choice, else where it speaks for them."""
        mask = self._real.connected.copy()
        for k, real in self._chosen.items():
            mask[k] = real
        return mask

    @property
    def truth(self) -> Truth:
        """What is really so of the arm and the simulated part."""
        return self._simulated.truth

    def use(self, k: int, real: bool) -> None:
        """Feed sensor k from the real skin or from the simulation, from the next poll on."""
        self._chosen[k] = real

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Frames of both, each only of its own sensors."""
        real_frames = self._real.poll(now, posture)
        real = self.real
        self._simulated.muted = set(np.flatnonzero(real).tolist())
        simulated_frames = self._simulated.poll(now, posture)
        return [f for f in real_frames if real[f.sensor]] + [
            f for f in simulated_frames if not real[f.sensor]
        ]

    def wait(self) -> None:
        """Until the simulated part is ready; SensorError when it is not in time."""
        if isinstance(self._simulated, SimulatedSkinApart):
            self._simulated.wait()

    def ended(self) -> str:
        """The real part's end, unless nobody listens to it any more."""
        return self._real.ended() if self.real.any() else ""

    def fault(self, now: float, silence: float, used: NDArray[np.bool_]) -> str:
        """What is wrong with either part, as far as it is used."""
        real = self.real
        return self._real.fault(now, silence, used & real) or self._simulated.fault(
            now, silence, used & ~real
        )

    def inputs(self, now: float) -> tuple[tuple[str, str], ...]:
        """Those of both parts."""
        return (*self._real.inputs(now), *self._simulated.inputs(now))

    def close(self) -> None:
        """Give back the real part's ports, and end the other's process if it has one."""
        try:
            self._real.close()
        finally:
            self._simulated.close()
