"""The controller's clock on ours."""

DRIFT = 200e-6  # how much faster or slower the controller's clock may run
JUMP = 1.0  # [s] a larger change means that the controller was started anew


class ControllerClock:
    """Maps the controller's timestamps to the runtime's clock by the shortest way seen.

    Every state is late by its way here; the least late one tells how the clocks stand to each
    other, and the estimate is loosened slowly since the clocks drift apart.
    """

    def __init__(self) -> None:
        self._ahead: float | None = None  # [s] our clock minus theirs
        self._asked = 0.0
        self._last = 0.0

    def stamp(self, theirs: float, now: float) -> float:
        """When a state with the timestamp `theirs` was taken [s]; never later than `now`, never
        before the last answer."""
        ahead = now - theirs
        if self._ahead is None or abs(ahead - self._ahead) > JUMP:
            self._ahead = ahead
        else:
            self._ahead = min(ahead, self._ahead + DRIFT * (now - self._asked))
        self._asked = now
        self._last = max(self._last, min(theirs + self._ahead, now))
        return self._last
