"""States before some ticks, so that no tick is far from one: bounded, evenly spread.

Besides those that are spread over the whole recording some are kept of where one has just been,
however long the recording is.
"""

from collections import OrderedDict
from typing import Generic, TypeVar

S = TypeVar("S")
MOST = 64  # states that are spread out; one of a brain is about 3 MB
NEAR = 16  # states of where one has been lately
SPACING = 128  # ticks at first: half a second at 250 Hz


class Keyframes(Generic[S]):
    """States by the tick that they come before; when there are too many, every second one goes."""

    def __init__(self, most: int = MOST, near: int = NEAR, spacing: int = SPACING) -> None:
        self.spacing = self._finest = spacing
        self._most, self._nearest = most, near
        self._spread: dict[int, S] = {}
        self._near: OrderedDict[int, S] = OrderedDict()

    def __len__(self) -> int:
        return len(self._spread) + len(self._near)

    def due(self, i: int, near: bool = True) -> bool:
        """Should the state before tick i be put here on the way along? near: also for a while."""
        return i % (self._finest if near else self.spacing) == 0 and not self.has(i)

    def has(self, i: int) -> bool:
        """Is the state before tick i here?"""
        return i in self._spread or i in self._near

    def put(self, i: int, state: S) -> None:
        """Keep the state before tick i: for good where it fits the spacing, else for a while."""
        if i % self.spacing:
            self._near[i] = state
            if len(self._near) > self._nearest:
                self._near.popitem(last=False)
            return
        self._spread[i] = state
        while len(self._spread) > self._most:
            self.spacing *= 2
            self._spread = {k: s for k, s in self._spread.items() if k % self.spacing == 0}

    def before(self, i: int) -> tuple[int, S]:
        """The last state at or before tick i, and its tick; KeyError where there is none."""
        found = max((k for k in (*self._spread, *self._near) if k <= i), default=-1)
        return found, self._spread[found] if found in self._spread else self._near[found]
