"""The controller's clock on ours."""

WINDOW = 1.0  # [s] the shortest way of this long and the one before counts
JUMP = 1.0  # [s] a larger change means that the controller was started anew


class ControllerClock:
    """Maps the controller's timestamps to the runtime's clock by the shortest way seen lately.

    Every state is late by its way here; the least late one tells how the clocks stand to each
    other. Older ones are forgotten, since the clocks drift apart.
    """

    def __init__(self) -> None:
        self._before = self._least = float("inf")  # [s] our clock minus theirs
        self._since = 0.0  # when the present window began
        self._last = 0.0

    def stamp(self, theirs: float, now: float) -> float:
        """When a state with the timestamp `theirs` was taken [s]; never later than `now`, never
        before the last answer."""
        ahead = now - theirs
        known = min(self._before, self._least)
        if abs(ahead - known) > JUMP:
            self._before = self._least = ahead
            self._since = now
        elif now - self._since > WINDOW:
            self._before, self._least, self._since = self._least, ahead, now
        self._least = min(self._least, ahead)
        self._last = max(self._last, min(theirs + min(self._before, self._least), now))
        return self._last
