"""Ways between stops: from rest to rest with soft ramps, as pure functions of time."""

from dataclasses import dataclass, field

import numpy as np

from app.messages import Array, freeze

RAMP = 0.4  # s, in which a mover gains or loses its speed


def smoothstep(x: float) -> float:
    """0 up to x = 0, 1 from x = 1, and level at both ends."""
    x = min(max(x, 0.0), 1.0)
    return x * x * (3.0 - 2.0 * x)


def travel_time(length: float, speed: float) -> float:
    """Seconds for `length` [m] at a cruising `speed` [m/s], with its two ramps."""
    return max(length / speed + RAMP, 2 * RAMP)


def travelled(t: float, length: float, speed: float) -> tuple[float, float]:
    """Way [m] and speed [m/s] after `t` seconds, from rest to rest over `length` [m].

    The speed rises as a smoothstep within `RAMP`, cruises, and falls the same way; a way too
    short for the ramps keeps them and cruises more slowly.
    """
    total = travel_time(length, speed)
    cruise = length / (total - RAMP)
    t = min(max(t, 0.0), total)
    x = min(t, total - t) / RAMP
    if x >= 1.0:
        return cruise * (t - RAMP / 2), cruise
    way = cruise * RAMP * x**3 * (1.0 - x / 2)  # the smoothstep's integral
    return (way if t <= total / 2 else length - way), cruise * smoothstep(x)


@dataclass(frozen=True, eq=False, slots=True)
class Stage:
    """One stretch of a route at some time: a stay at a stop, or the way to the next.

    stop:     the stop stayed at or left.   moving: on its way?
    elapsed, duration: [s] in this stage.   way: [m] since the stop.   speed: [m/s].
    position: (3,) [m], base frame.
    """

    stop: int
    moving: bool
    elapsed: float
    duration: float
    way: float
    speed: float
    position: Array


@dataclass(frozen=True, eq=False)
class Route:
    """Straight ways between stops, resting at each.

    stops: (n, 3) [m], base frame.   dwell: (n,) [s] spent at each.   speed: [m/s], cruising.
    loop:  back to the first stop and on for ever; else it ends at the last.
    """

    stops: Array
    dwell: Array
    speed: float
    loop: bool = True
    starts: Array = field(init=False)  # of stay 0, way 0, stay 1, ... and the end [s]
    lengths: Array = field(init=False)  # of the ways [m]

    def __post_init__(self) -> None:
        ways = np.diff(self.stops, axis=0, append=self.stops[:1])
        lengths = np.linalg.norm(ways, axis=1)
        times = [travel_time(float(s), self.speed) for s in lengths]
        stages = np.column_stack([self.dwell, times]).ravel()
        object.__setattr__(self, "lengths", freeze(lengths))
        object.__setattr__(self, "starts", freeze(np.append(0.0, np.cumsum(stages))))

    @property
    def period(self) -> float:
        """Seconds of one round, or until it rests at the last stop for good."""
        return float(self.starts[-1] if self.loop else self.starts[-2])

    def at(self, t: float) -> Stage:
        """The stage at `t` [s]; a route that does not loop stays at its ends."""
        t = t % self.period if self.loop else min(max(t, 0.0), self.period)
        last = len(self.starts) - (2 if self.loop else 3)
        k = min(int(np.searchsorted(self.starts, t, side="right")) - 1, last)
        stop, moving = divmod(k, 2)
        elapsed, here = t - float(self.starts[k]), self.stops[stop]
        duration = float(self.starts[k + 1] - self.starts[k])
        if not moving:
            return Stage(stop, False, elapsed, duration, 0.0, 0.0, here)
        length = float(self.lengths[stop])
        way, speed = travelled(elapsed, length, self.speed)
        there = self.stops[(stop + 1) % len(self.stops)]
        position = here + (there - here) * (way / length)
        return Stage(stop, True, elapsed, duration, way, speed, position)
