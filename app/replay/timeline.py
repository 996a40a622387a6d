"""Any tick of a recording, exactly as it was: forwards by stepping, elsewhere from a keyframe."""

from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple

from app.messages import GhostState, Snapshot, Timing
from app.record.recording import Recording
from app.replay.keyframes import Keyframes
from app.replay.mind import Mind, Minds
from app.tick import Inputs, Outputs, Tick, snapshot_of

KEPT = 300  # ticks that are at hand: stepping back over them costs nothing


class Moment(NamedTuple):
    """One tick: what went in, what came out, and what a ghost made of it."""

    inputs: Inputs
    outputs: Outputs
    ghost: GhostState | None


def never() -> bool:
    """Nothing interrupts."""
    return False


class Timeline:
    """Recomputes ticks of `recording` with `mind`, which must be as it was before the first one.

    frontier: the first tick that was never computed; all before it were, and have keyframes.
    watch:    told every tick and its moment when it is computed for the first time.
    """

    def __init__(self, recording: Recording, mind: Mind, keep: int = KEPT) -> None:
        self.recording, self.mind, self._keep = recording, mind, keep
        self.keyframes: Keyframes[Minds] = Keyframes()
        self.frontier = 0
        self.watch: Callable[[int, Moment], None] | None = None
        self._next = 0  # the tick that the mind is ready for
        self._kept: OrderedDict[int, Moment] = OrderedDict()

    def __len__(self) -> int:
        return len(self.recording)

    @property
    def computed(self) -> int:
        """The tick that was computed last; -1 before the first."""
        return self._next - 1

    def tick(self, i: int) -> Tick:
        """Inputs and Outputs of tick i, bit for bit as they were; IndexError beyond the ends."""
        m = self.moment(i)
        return m.inputs, m.outputs

    def moment(self, i: int) -> Moment:
        """The same with the ghost's."""
        self.reach(i)
        return self._kept[i]

    def reach(self, i: int, interrupted: Callable[[], bool] = never) -> bool:
        """Compute towards tick i; False if that was interrupted, and to be gone on with.

        Every call computes a tick at least, so who asks often enough arrives.
        """
        if not 0 <= i < len(self):
            raise IndexError(f"tick {i} of a recording of {len(self)}")
        if i in self._kept:
            return True
        self._begin_before(i)
        while True:
            self._step()
            if i < self._next:
                return True
            if interrupted():
                return False

    def explore(self, interrupted: Callable[[], bool] = never) -> bool:
        """Compute on from the frontier; True when there is nothing left that was never computed."""
        while self.frontier < len(self):
            self._begin_before(self.frontier)
            self._step(near=False)
            if interrupted():
                break
        return self.frontier == len(self)

    def snapshot(self, i: int) -> Snapshot:
        """What an onlooker saw of tick i, with the recorded bodies."""
        x, out, ghost = self.moment(i)
        return snapshot_of(x, out, Timing({}, x.late), self.recording.bodies(i), ghost)

    def _begin_before(self, i: int) -> None:
        """Have the mind ready for tick i, or for one before it that is not far."""
        if self._next == i:
            return
        found, state = (-1, None) if not len(self.keyframes) else self.keyframes.before(i)
        if self._next < i and found <= self._next:
            return
        if self._next < len(self) and not self.keyframes.has(self._next):
            self.keyframes.put(self._next, self.mind.capture())  # to come back at once
        assert state is not None  # ticks were computed before, and the first one left a keyframe
        self.mind.restore(state)
        self._next = found

    def _step(self, near: bool = True) -> None:
        i = self._next
        x = self.recording.inputs(i)
        if self.keyframes.due(i, near):
            self.keyframes.put(i, self.mind.capture())
        moment = Moment(x, *self.mind.tick(x))
        self._next = i + 1
        if near:
            self._kept[i] = moment
            self._kept.move_to_end(i)
            if len(self._kept) > self._keep:
                self._kept.popitem(last=False)
        if i == self.frontier:
            self.frontier += 1
            if self.watch is not None:
                self.watch(i, moment)
