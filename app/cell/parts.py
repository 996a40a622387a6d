"""The known cell as values: boxes, half-spaces and what was learned.

All of it is read twice. The static filter takes points in it for the cell and not for
obstacles, and the controller keeps the arm out of it: what the one hides the other bounds.
"""

from dataclasses import dataclass

from app.cell.learned import NOTHING_LEARNED, Learned
from app.messages import Array

LEARNED = "learned background"  # its name among the parts


@dataclass(frozen=True, eq=False, slots=True)
class Box:
    """T_base_box: (4, 4) pose of the box's centre.   size: (3,) full edge lengths [m]."""

    name: str
    T_base_box: Array
    size: Array


@dataclass(frozen=True, eq=False, slots=True)
class HalfSpace:
    """All that lies below the x-y plane of T_base_plane (4, 4), without end.

    size: (2,) [m] of the patch that is drawn of it; nothing else depends on it.
    """

    name: str
    T_base_plane: Array
    size: Array


@dataclass(frozen=True, eq=False, slots=True)
class Cell:
    """What stands at the place for good; `Cell()` is nothing at all."""

    title: str = ""
    boxes: tuple[Box, ...] = ()
    planes: tuple[HalfSpace, ...] = ()
    learned: Learned = NOTHING_LEARNED

    def __bool__(self) -> bool:
        """Is anything known?"""
        return bool(self.boxes or self.planes or len(self.learned))

    @property
    def names(self) -> tuple[str, ...]:
        """Of the boxes, then of the planes, then of what was learned."""
        return (*(b.name for b in self.boxes), *(p.name for p in self.planes), LEARNED)
