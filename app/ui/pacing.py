"""Small rules of time: not more often than, not too many, not right after a person's hand."""

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

    def anew(self) -> None:
        """Whenever it is asked next, it is due."""
        self._last = None


class Bucket:
    """So many a second in the long run, and so many at once."""

    def __init__(self, rate: float, burst: float) -> None:
        self._rate, self._burst = rate, burst
        self._left = burst
        self._last: float | None = None

    def take(self, now: float, amount: float = 1.0) -> bool:
        """Whether so much is left for this moment; `now` [s]."""
        if self._last is not None:
            self._left = min(self._left + self._rate * max(now - self._last, 0.0), self._burst)
        self._last = now
        if self._left < amount:
            return False
        self._left -= amount
        return True


class Shares:
    """A bucket for each who comes, so that nobody uses up what is another's."""

    def __init__(self, rate: float, burst: float, most: int = 256) -> None:
        self._rate, self._burst, self._most = rate, burst, most
        self._buckets: dict[str, Bucket] = {}  # the longest unseen first

    def take(self, who: str, now: float) -> bool:
        """Whether one is left for `who`; beyond `most` the longest unseen is forgotten."""
        bucket = self._buckets.pop(who, None) or Bucket(self._rate, self._burst)
        self._buckets[who] = bucket
        if len(self._buckets) > self._most:
            del self._buckets[next(iter(self._buckets))]
        return bucket.take(now)


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

    def release(self, holder: int | None) -> bool:
        """The window `holder` lets go; False if it held nothing."""
        held = holder in self._holders
        self._holders.discard(holder)
        if held:
            self.touch()
        return held

    @property
    def free(self) -> bool:
        """Whether the arm's own value may be shown."""
        return not self._holders and self._clock.now() >= self._free_at
