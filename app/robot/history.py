"""The last second of joint positions, so that a frame is placed where the arm was."""

import numpy as np

from app.compiled import compiled
from app.messages import Array, JointState

SPAN = 0.01  # [s] to either side over which a speed is taken


class JointHistory:
    """Ring of (stamp, q); `at(t)` interpolates linearly and clamps at both ends."""

    def __init__(self, joints: int, length: int = 512) -> None:
        self._stamp = np.full(length, -np.inf)
        self._q = np.zeros((length, joints))
        self._count = 0

    def append(self, state: JointState) -> None:
        """Remember a state; stamps must not go back."""
        i = self._count % len(self._stamp)
        self._stamp[i], self._q[i] = state.stamp, state.q
        self._count += 1

    def at(self, stamp: float) -> Array:
        """q (n,) at `stamp`, the oldest or newest kept one outside the remembered span."""
        if self._count == 0:
            raise LookupError("no joint state has been appended yet")
        q = np.empty(self._q.shape[1])
        _between(self._stamp, self._q, self._count, stamp, q)
        return q

    def speed(self, stamp: float) -> Array:
        """qd (n,) around `stamp`, zero outside the remembered span."""
        before, after = self.at(stamp - SPAN), self.at(stamp + SPAN)
        return np.asarray((after - before) / (2.0 * SPAN))

    def reset(self) -> None:
        """Forget everything."""
        self._stamp[:], self._q[:], self._count = -np.inf, 0.0, 0


@compiled
def _between(stamps: Array, q: Array, count: int, stamp: float, out: Array) -> None:
    """Write q (n,) at `stamp` from rings (N,), (N, n) in which `count` were ever put.

    From the newest backwards: frames are young, so that is a handful of steps.
    """
    size = len(stamps)
    newest = (count - 1) % size
    out[:] = q[newest]
    if stamp >= stamps[newest]:
        return
    for back in range(1, min(count, size)):
        i = (newest - back) % size
        j = (i + 1) % size
        if stamps[i] <= stamp:
            span = stamps[j] - stamps[i]
            share = (stamp - stamps[i]) / span if span > 0.0 else 1.0
            for k in range(len(out)):
                out[k] = q[i, k] + share * (q[j, k] - q[i, k])
            return
        out[:] = q[i]
