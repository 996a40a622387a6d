"""What every source of frames can do; there are two, `simulated` and `replay`."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.messages import SensorFrame
from app.robot.posture import Posture


class Source(Protocol):
    """A stream of frames from some or all sensors of a skin.

    name:      what it is, for a person.
    connected: (K,) bool, sensors that this source speaks for.
    """

    name: str
    connected: NDArray[np.bool_]

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Frames that have arrived by `now` [s]; `posture` is where the arm really is."""
        ...

    def ended(self) -> str:
        """Why no more frames will ever come; empty while they may."""
        ...
