"""What a recording is to whoever replays, exports or compares it; from a file or from memory."""

from collections.abc import Sequence
from typing import Protocol

from app.messages import Array, BodyPose
from app.record.head import Head
from app.record.marks import Mark
from app.record.witness import Witness
from app.tick import Inputs


class Recording(Protocol):
    """The ticks of one run in their order, i = 0 ... len - 1.

    head:    how it begins.   torn: why it ends before its end, in words; empty if it is whole.
    dropped: ticks that found no room and are missing in between; `Inputs.tick` tells where.
    times:   (N,) [s] `Inputs.now` of each.   marks: in the order of their ticks.
    """

    @property
    def head(self) -> Head: ...
    @property
    def torn(self) -> str: ...
    @property
    def dropped(self) -> int: ...
    @property
    def times(self) -> Array: ...
    @property
    def marks(self) -> Sequence[Mark]: ...

    def __len__(self) -> int: ...

    def inputs(self, i: int) -> Inputs:
        """What entered the tick; IndexError beyond the ends."""
        ...

    def witness(self, i: int) -> Witness:
        """Of what came out of it."""
        ...

    def bodies(self, i: int) -> tuple[BodyPose, ...]:
        """The simulated bodies as they were last seen by then; empty where nobody knows them."""
        ...
