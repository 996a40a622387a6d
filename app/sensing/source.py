"""What every source of frames can do: `simulated`, `replay`, `serial_skin`, and `mixed`."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.messages import SensorFrame
from app.robot.posture import Posture


class Unfailing:
    """What sources have in common that read no device."""

    def fault(self, now: float, silence: float, used: NDArray[np.bool_]) -> str:
        """Nothing can be unplugged."""
        return ""

    def inputs(self, now: float) -> tuple[tuple[str, str], ...]:
        """Nothing to tell beyond the name."""
        return ()

    def close(self) -> None:
        """Nothing is held."""


class Source(Protocol):
    """A stream of frames from some or all sensors of a skin.

    name: what it is, for a person.
    """

    name: str

    @property
    def connected(self) -> NDArray[np.bool_]:
        """(K,) sensors that this source speaks for; a source of ports learns of them."""
        ...

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Frames that have arrived by `now` [s]; `posture` is where the arm really is."""
        ...

    def ended(self) -> str:
        """Why no more frames will ever come; empty while they may."""
        ...

    def fault(self, now: float, silence: float, used: NDArray[np.bool_]) -> str:
        """Why the arm must not move at `now` [s] though frames may come again; empty if it may.

        silence: [s] that is borne.   used: (K,) sensors that somebody relies on.
        """
        ...

    def inputs(self, now: float) -> tuple[tuple[str, str], ...]:
        """Names of what it reads from, and how each is, for a person."""
        ...

    def close(self) -> None:
        """Give back what it holds."""
        ...
