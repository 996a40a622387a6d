"""The last second of joint positions, so that a frame is placed where the arm was."""

import numpy as np

from app.messages import Array, JointState


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
        size = len(self._stamp)
        held = min(self._count, size)
        if held == 0:
            raise LookupError("no joint state has been appended yet")
        # walk back from the newest: frames are young, so this is a handful of steps
        newest = (self._count - 1) % size
        if stamp >= self._stamp[newest]:
            return self._q[newest].copy()
        for back in range(1, held):
            i = (newest - back) % size
            if self._stamp[i] <= stamp:
                j = (i + 1) % size
                span = self._stamp[j] - self._stamp[i]
                share = (stamp - self._stamp[i]) / span if span > 0.0 else 1.0
                return self._q[i] + share * (self._q[j] - self._q[i])
        return self._q[(self._count - held) % size].copy()

    def reset(self) -> None:
        """Forget everything."""
        self._stamp[:], self._q[:], self._count = -np.inf, 0.0, 0
