"""When simulated sensors measure, and when their frames arrive."""

from math import floor

RATE = 15.0  # [Hz] the fastest for 8x8 (UM3109)
LATENCY = 0.05  # [s] from measurement to the host
EARLY = 1e-9  # [s] that rounding may make a time late


class Schedule:
    """When each of `count` sensors measures: at RATE, staggered evenly over one period."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._next: list[float] = []  # [s], of each sensor; empty before the first call

    def due(self, now: float) -> list[int]:
        """The sensors that measure now."""
        period, count = 1.0 / RATE, self._count
        if not self._next:
            self._next = [now + period * k / count for k in range(count)]
        due = [k for k, t in enumerate(self._next) if t <= now + EARLY]
        for k in due:
            # a sensor keeps its rhythm: what a stall has swallowed is not sent in a burst
            self._next[k] += period * (floor((now - self._next[k]) / period + 1e-6) + 1.0)
        return due
