"""How often the frames of one text stream come: faster than any sensor, or too slowly to be of use.

A stream that gives more frames than its sensor can measure prints something else as well, most
likely its statuses, or the frames of several sensors.
"""

from collections import deque

from app.sensing.wire.raw import RawFrame

SPAN = 3.0  # [s] over which frames are counted; a pause of the host does not count twice
# [Hz] the most of the sensors that print (UM3109), by zones; more zones are other sensors'
FASTEST = {16: 60.0, 64: 15.0}
OTHERS = 60.0
TOLERATED = 1.5  # frames that were late come together
SLOW = 4.0  # [Hz] below, an arm that relies on it slows down or stops
REMEDY = "raise the sketch's ranging frequency (setRangingFrequency, 15 Hz for 8x8) and its baud"


class Rate:
    """Counts frames of each sensor; `trouble` is what cannot be right."""

    def __init__(self) -> None:
        self.trouble = ""
        self._times: dict[int | None, deque[float]] = {}

    @property
    def hz(self) -> float:
        """The slowest sensor's lately; 0 while there are too few frames."""
        spans = ((len(t) - 1, t[-1] - t[0]) for t in self._times.values() if len(t) > 2)
        rates = [n / span for n, span in spans if span > 0.0]
        return min(rates, default=0.0)

    def count(self, frame: RawFrame, now: float) -> str:
        """A frame at `now` [s]; says what is wrong, empty if nothing is."""
        times = self._times.setdefault(frame.sensor, deque())
        times.append(now)
        while now - times[0] > SPAN and len(times) > 3:
            times.popleft()
        most = FASTEST.get(len(frame.status), OTHERS)
        many = sum(now - t <= SPAN for t in times) > SPAN * most * TOLERATED
        if many:
            rows, columns = frame.grid
            self.trouble = (
                f"it gives {len(times) / SPAN:.0f} frames of {rows}x{columns} a second, and its "
                f"sensor can measure {most:.0f}; it prints more than distances, or several "
                "sensors: describe its print in a file, PORT#FILE.toml"
            )
            while len(times) > SPAN * most * TOLERATED:
                times.popleft()
        else:
            self.trouble = ""
        return self.trouble


def slow_words(hz: float) -> str:
    """What to do about a stream that is too slow; empty of one that is not."""
    return f"{hz:.1f} frames a second are too few: {REMEDY}" if 0.0 < hz < SLOW else ""
