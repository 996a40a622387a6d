"""Two small rules of time: not more often than, and not right after a person's hand."""

from app.timing import Clock

HANDS_OFF = 0.3  # [s] after a person's change, until the arm's own value is shown again


class Every:
    """True at most once in `period` seconds; a clock that was set back starts anew."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._last: float | None = None

    def due(self, now: float) -> bool:
        if self._last is not None and 0.0 <= now - self._last < self._period:
            return False
        self._last = now
        return True


class HandsOff:
    """Guards a control against echoes.

    While a person moves a handle, snapshots still carry the value of some ticks ago; shown at
    once it would pull the handle out of the hand.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._holders: set[int | None] = set()
        self._free_at = float("-inf")

    def touch(self) -> None:
        """A person has changed the value just now."""
        self._free_at = self._clock.now() + HANDS_OFF

    def grab(self, holder: int | None) -> None:
        """The window `holder` begins to drag."""
        self._holders.add(holder)

    def release(self, holder: int | None) -> None:
        """The window `holder` lets go."""
        self._holders.discard(holder)
        self.touch()

    @property
    def free(self) -> bool:
        """Whether the arm's own value may be shown."""
        return not self._holders and self._clock.now() >= self._free_at
