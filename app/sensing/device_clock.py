"""A board's microsecond clock on the host's axis: offset and drift from arrival times alone.

A frame arrives some delay after its stamp, never before. So the points (device time, arrival)
lie on or above the line arrival = offset + (1 + drift) * device; of all lines below the points
the one with the smallest sum of distances is an edge of their lower convex hull, the edge that
spans their mean (Zhang, Liu and Xia, INFOCOM 2002). The hull is taken of the earliest arrival
in each of the last windows. What remains unknown is the smallest delay itself: stamps are late
by it, a tenth of a millisecond on USB.

The 32-bit clock wraps every 71.6 minutes; unwrapping follows the host's clock, so that silence
of any length is bridged. A clock that goes back, leaps ahead or is late for good begins anew:
the board was reset. Frames that are late for a moment were held up and keep their stamps. What is
no clock at all is named by `app.sensing.clock_watch`.
"""

from collections import deque

from app.sensing.clock_watch import ClockWatch

WRAP = 1 << 32
WINDOW = 1.0  # [s]
WINDOWS = 60
SPAN = 5.0  # [s] the hull must reach this far before drift is believed
DRIFT_LIMIT = 500e-6  # crystals keep within 100 ppm, ceramic resonators within a few hundred
JUMP = 0.5  # [s] a larger step back or ahead is a reset ...
DOUBT = 1e-3  # ... where this share of a silence is allowed for drift
LASTING = 10.0  # [s] frames late by JUMP for so long were not just held up: no buffer lasts longer


class DeviceClock:
    """Maps `t_us` of one board to the host's clock [s]."""

    def __init__(self) -> None:
        self.restarts = -1  # how often the board's clock began anew; the first start is none
        self.drift = 0.0  # how much slower the board's clock runs than the host's
        self._device: float | None = None  # [s] unwrapped, of the newest frame
        self._window: tuple[float, float] | None = None
        self._raw = 0
        self._watch = ClockWatch()
        self._arrival = self._punctual = 0.0
        self._begin()

    def stamp(self, t_us: int, arrival: float) -> float:
        """When a frame was measured [s, host's clock], never later than its arrival."""
        device = self._unwrap(t_us, arrival)
        self._watch.see(t_us, device, arrival)
        return self._placed(t_us, device, arrival)

    @property
    def trouble(self) -> str:
        """Why its stamps are not to be believed; empty while they are."""
        return self._watch.trouble

    def _placed(self, t_us: int, device: float, arrival: float) -> float:
        """The stamp of a frame whose clock says `device` [s]."""
        delay = arrival - device  # and an unknown offset
        if self._window is None:
            self._window, self._window_end, self._offset = (device, delay), device + WINDOW, delay
        elif device >= self._window_end:
            self._earliest.append(self._window)
            self._fit()
            self._window, self._window_end = (device, delay), device + WINDOW
        elif delay < self._window[1] and device >= self._window_end - WINDOW:
            self._window = (device, delay)
        # a frame that arrives earlier than the line believes moves the line
        expected = self._offset + self.drift * (device - self._zero)
        if delay < expected:
            self._offset -= expected - delay
            expected = delay
        if delay - expected < JUMP:
            self._punctual = arrival
        elif arrival - self._punctual > LASTING:
            self._begin()
            return self._placed(t_us, self._unwrap(t_us, arrival), arrival)
        return min(device + expected, arrival)

    def _begin(self) -> None:
        self.restarts += 1
        self.drift = 0.0
        self._offset = self._zero = 0.0
        self._device = None
        self._window = None
        self._window_end = 0.0
        self._earliest: deque[tuple[float, float]] = deque(maxlen=WINDOWS)

    def _unwrap(self, t_us: int, arrival: float) -> float:
        """Device time [s], continuous over wraps; frames may come in another order."""
        if self._device is not None:
            waited = arrival - self._arrival
            guess = self._raw + round(waited * 1e6)
            raw = guess + (t_us - guess + WRAP // 2) % WRAP - WRAP // 2
            step = (raw - self._raw) * 1e-6
            if not -JUMP <= step <= JUMP + (1.0 + DOUBT) * waited:
                self._begin()
                self._watch.leap(arrival)
        if self._device is None:
            raw, self._punctual = t_us, arrival
        device = raw * 1e-6
        if self._device is None or device > self._device:
            self._device, self._raw, self._arrival = device, raw, arrival
        return device

    def _fit(self) -> None:
        points = list(self._earliest)
        if points[-1][0] - points[0][0] < SPAN:
            (self._zero, self._offset), self.drift = min(points, key=lambda p: p[1]), 0.0
            return
        hull: list[tuple[float, float]] = []
        for p in points:
            while len(hull) > 1 and _turn(hull[-2], hull[-1], p) <= 0.0:
                hull.pop()
            hull.append(p)
        mean = sum(x for x, _ in points) / len(points)
        i = next((i for i in range(1, len(hull)) if hull[i][0] >= mean), len(hull) - 1)
        (x0, y0), (x1, y1) = hull[i - 1], hull[i]
        self.drift = min(max((y1 - y0) / (x1 - x0), -DRIFT_LIMIT), DRIFT_LIMIT)
        self._zero, self._offset = x0, y0


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Positive where a, b, c turn left, as a lower hull does."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
