"""Places: how many sockets may wait at the door, how many pages may be inside, and who goes.

Whoever fills them shall not keep out the person who operates, so a newcomer is let in and
another goes for it: never the operator, nobody who is trusted for one who is not; then of the
address that has the most, the one that came first. A flood thus displaces itself.
"""

from collections import Counter
from collections.abc import Iterable
from enum import IntEnum
from typing import Generic, Protocol, TypeVar


class Rank(IntEnum):
    """Who stays when there are too many; the higher the longer."""

    STRANGER = 0
    TRUSTED = 1  # has told the token, or comes from a browser that has operated
    OPERATOR = 2


class Comer(Protocol):
    """A socket, as far as places are concerned."""

    @property
    def neighbourhood(self) -> str: ...  # where it comes from: an address, or a net of them
    @property
    def rank(self) -> Rank: ...


C = TypeVar("C", bound=Comer)


class Places(Generic[C]):
    """Who waits and who is inside, both in order of arrival. Not thread-safe."""

    def __init__(self, most_waiting: int, most_inside: int) -> None:
        self._most_waiting, self._most_inside = most_waiting, most_inside
        self.waiting: dict[C, None] = {}
        self.inside: dict[C, None] = {}

    def arrive(self, comer: C) -> C | None:
        """`comer` waits. Returns who has to go for it, None if there was room."""
        goes = _first_of_most(self.waiting) if len(self.waiting) >= self._most_waiting else None
        if goes is not None:
            del self.waiting[goes]
        self.waiting[comer] = None
        return goes

    def enter(self, comer: C) -> tuple[bool, C | None]:
        """Whether `comer`, who waits, is inside now, and who has to go for it."""
        goes = None
        if len(self.inside) >= self._most_inside:
            limit = min(comer.rank, Rank.TRUSTED)  # there is one operator: it is never asked to go
            lowest = min(inside.rank for inside in self.inside)
            if lowest > limit:
                return False, None
            goes = _first_of_most(self.inside, lowest)
            del self.inside[goes]
        self.waiting.pop(comer, None)
        self.inside[comer] = None
        return True, goes

    def leave(self, comer: C) -> None:
        """`comer` is gone, wherever it was."""
        self.waiting.pop(comer, None)
        self.inside.pop(comer, None)


def _first_of_most(comers: Iterable[C], rank: Rank | None = None) -> C:
    """The first that came, of the neighbourhood with the most; only of `rank` if it is given."""
    comers = list(comers)
    count = Counter(c.neighbourhood for c in comers)
    may_go = [c for c in comers if rank is None or c.rank == rank]
    return max(may_go, key=lambda c: count[c.neighbourhood])
