"""Inputs that were recorded, given once more: what would another brain have done?

Nobody can move what has happened: commands go nowhere, and what is read as applied is what the
recorded arm was told. People of now are heard by the brain alone.
"""

from collections.abc import Sequence

from app.actions import Action
from app.messages import Array, BodyPose
from app.plant.plant import Reading, nothing_to_edit
from app.tick import Inputs, Limits


class RecordedPlant:
    """Plays `inputs` in their order, one a reading; `limits` are those of the recorded arm."""

    editable = False

    def __init__(self, inputs: Sequence[Inputs], limits: Limits, name: str = "recorded") -> None:
        self.name, self.limits = name, limits
        self._inputs, self._next = inputs, 0

    @property
    def left(self) -> int:
        """Inputs that have not been read yet."""
        return len(self._inputs) - self._next

    def whole(self) -> Inputs:
        """The next Inputs as they were, with time, actions and all; IndexError after the last."""
        x = self._inputs[self._next]
        self._next += 1
        return x

    def read(self, now: float, patience: float) -> Reading:
        x = self.whole()
        return Reading(x.joints, x.applied, x.arm, x.frames, x.source)

    def send(self, qd: Array, dt: float) -> Array:
        return self._inputs[min(self._next, len(self._inputs) - 1)].applied

    def engage(self) -> None:
        """Nobody is there to be engaged."""

    def act(self, action: Action) -> None:
        raise nothing_to_edit(action)

    def bodies(self) -> tuple[BodyPose, ...]:
        return ()

    def close(self) -> None:
        """Nothing is held."""
