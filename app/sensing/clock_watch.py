"""Is a board's clock a clock? One that stands still, runs backwards, leaps or runs at another pace
says nothing about when a frame was measured, so its frames are not given on.

What the line holds up is no fault of the clock: frames then come late and all at once, so every
judgement spans a time of arrivals, not a number of frames.
"""

from collections import deque

STANDS = 0.3  # [s] of arrivals with one and the same stamp, or with ever smaller ones
FEW = 4  # frames in them
LEAPS, WITHIN = 3, 10.0  # leaps in so many seconds are no reset of the board
PACE, SPAN = 0.1, 4.0  # share by which the pace may be off, over so many seconds, twice
HEALED = 2.0  # [s] without a fault


class ClockWatch:
    """Follows the raw stamps of one stream; `trouble` is what is the matter, empty while all is
    well."""

    def __init__(self) -> None:
        self.trouble = ""
        self._raw: int | None = None  # [us] of the last frame
        self._same = self._back = 0  # frames of the present run
        self._same_since = self._back_since = 0.0
        self._leaps: deque[float] = deque(maxlen=LEAPS)
        self._begin: tuple[float, float] | None = None  # device and host [s]
        self._odd = 0  # windows in which the pace was off
        self._seen_at = float("-inf")  # the last fault

    def leap(self, arrival: float) -> None:
        """The clock has begun anew at `arrival` [s]."""
        self._leaps.append(arrival)
        self._begin, self._odd = None, 0
        if len(self._leaps) == LEAPS and arrival - self._leaps[0] < WITHIN:
            self._say("leaps again and again: the board restarts, or its stamps are none", arrival)

    def see(self, t_us: int, device: float, arrival: float) -> None:
        """A frame of `t_us`, unwrapped `device` [s], at `arrival` [s]."""
        step = 0 if self._raw is None else t_us - self._raw
        first = self._raw is None
        self._raw = t_us
        self._same = 0 if step or first else self._same + 1
        self._back = self._back + 1 if step < 0 else 0
        if self._same <= 1:
            self._same_since = arrival
        if self._back <= 1:
            self._back_since = arrival
        if self._same >= FEW and arrival - self._same_since > STANDS:
            self._say("stands still", arrival)
        if self._back >= FEW and arrival - self._back_since > STANDS:
            self._say("runs backwards", arrival)
        self._pace(device, arrival)
        if self.trouble and arrival - self._seen_at > HEALED:
            self.trouble = ""

    def _pace(self, device: float, arrival: float) -> None:
        if self._begin is None:
            self._begin = device, arrival
            return
        theirs, ours = device - self._begin[0], arrival - self._begin[1]
        if ours < SPAN:
            return
        pace = theirs / ours
        self._odd = self._odd + 1 if abs(pace - 1.0) > PACE else 0
        self._begin = device, arrival
        if self._odd > 1:
            self._say(f"runs at {pace:.2g} times the pace of time: are its stamps us?", arrival)

    def _say(self, what: str, arrival: float) -> None:
        self.trouble, self._seen_at = f"its clock {what}", arrival
