"""When simulated sensors measure, and when their frames arrive."""

from collections.abc import Sequence
from math import floor

LATENCY = 0.05  # [s] from measurement to the host
EARLY = 1e-9  # [s] that rounding may make a time late


class Schedule:
    """When each of K sensors measures: every so often, periods (K,) [s], staggered evenly."""

    def __init__(self, periods: Sequence[float]) -> None:
        self._periods = tuple(periods)
        self._next: list[float] = []  # [s], of each sensor; empty before the first call

    def due(self, now: float) -> list[int]:
        """The sensors that measure now."""
        if not self._next:
            count = len(self._periods)
            self._next = [now + period * k / count for k, period in enumerate(self._periods)]
        due = [k for k, t in enumerate(self._next) if t <= now + EARLY]
        for k in due:
            period = self._periods[k]
            # a sensor keeps its rhythm: what a stall has swallowed is not sent in a burst
            self._next[k] += period * (floor((now - self._next[k]) / period + 1e-6) + 1.0)
        return due
