"""A recording in memory: for a test, and for whoever follows an engine and looks back at once."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from app.messages import Array, BodyPose
from app.record.head import Head
from app.record.marks import Mark, Marker
from app.record.witness import Witness, witness_of
from app.tick import Inputs, Tick


class Kept:
    """The ticks of a run as they were, in their order; `bodies`: those of each tick, or none."""

    torn, dropped = "", 0

    def __init__(
        self, head: Head, ticks: Sequence[Tick], bodies: Sequence[tuple[BodyPose, ...]] = ()
    ) -> None:
        self.head, self._ticks, self._bodies = head, tuple(ticks), tuple(bodies)

    def __len__(self) -> int:
        return len(self._ticks)

    @property
    def times(self) -> Array:
        """(N,) [s] on the run's clock."""
        return np.array([x.now for x, _ in self._ticks])

    @cached_property
    def marks(self) -> tuple[Mark, ...]:
        """All of them."""
        marker = Marker()
        return tuple(m for x, out in self._ticks for m in marker.marks(x, out))

    def inputs(self, i: int) -> Inputs:
        """What entered the tick."""
        return self._ticks[i][0]

    def witness(self, i: int) -> Witness:
        """Of what came out of it."""
        return witness_of(self._ticks[i][1])

    def bodies(self, i: int) -> tuple[BodyPose, ...]:
        """The simulated bodies at that tick."""
        return self._bodies[i] if self._bodies else ()
