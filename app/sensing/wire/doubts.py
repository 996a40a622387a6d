"""What cannot be right in grids that were taken for distances, each with its name and remedy.

A print that is described wrongly is a wrong skin: what is found here stops its port.
"""

import re
from collections import deque

from app.sensing.wire.described import GOOD, STATUSES, Print, Status
from app.sensing.wire.raw import NO_TARGET, VALID

STATUS = re.compile(r"\b(s|st|stat|status(es)?|\w*_status|target ?status)\b", re.IGNORECASE)
OTHER = re.compile(
    r"\b(sigma|signal|ambient|reflect\w*|spads?|confidence|motion|nb_?targets?|targets?|temp\w*)\b",
    re.IGNORECASE,
)
DISTANCE = re.compile(r"\b(d|dist\w*|range\w*|mm|depth\w*|\w*_mm)\b", re.IGNORECASE)
LONG_NUMBER = re.compile(r"\d+(?:[:.,]\d+)+|\d{3,}")
FEWEST = 16  # zones of the sensors whose statuses are known here
KEPT = 16  # headings that are remembered
TURNS = 2  # so often must two kinds of grids have taken turns
BAD = 15  # frames without one good status before that is named
APART = 100  # [mm] by which grids of two sensors differ at least, in the median
TWO = "it prints two grids, and they take turns: {}; describe its print in a file, PORT#FILE.toml"
WHICH = "say which in a file, PORT#FILE.toml"


def kind_of(heading: str) -> str:
    """What a heading says that its grid is: distance, status, other, or nothing of these."""
    distance, status = bool(DISTANCE.search(heading)), bool(STATUS.search(heading))
    if distance != status:
        return "distance" if distance else "status"
    return "other" if not distance and OTHER.search(heading) else ""


def like_statuses(values: list[int]) -> bool:
    """Could these be target statuses? Nothing but zeros could be anything."""
    return any(values) and STATUSES.issuperset(values)


class Doubts:
    """Follows the grids of one print. `lasting` is what no later grid can make good."""

    def __init__(self, how: Print) -> None:
        self.lasting = ""
        self._how = how
        self._headings: deque[str] = deque(maxlen=KEPT)
        self._turns = 0
        self._last_like = False
        self._before: deque[list[int]] = deque(maxlen=2)
        self._apart = 0
        self._bad = 0
        self._good = False

    def of_grid(self, heading: str, kind: str, values: list[int]) -> str:
        """What is wrong with a grid of bare distances [mm]; empty: nothing.

        kind: what stands right above it calls it, see `kind_of`.
        """
        if self.lasting or self._how.status is not Status.NONE:
            return self.lasting
        if kind == "status":
            self.lasting = TWO.format(f"one is called {heading.strip()[:40]!r}")
            return self.lasting
        like = like_statuses(values)
        if like and not self._last_like:
            self._turns += 1
        self._last_like = like
        if self._turns > TURNS:
            self.lasting = TWO.format("one looks like target statuses")
        return self.lasting or self._of_turns(heading, values)

    def _of_turns(self, heading: str, values: list[int]) -> str:
        """Do grids under two headings take turns, or grids that are nothing like each other?"""
        if self._last_like:
            return "its numbers look like target statuses, not like distances; " + WHICH
        if not self._how.sensors:
            name = LONG_NUMBER.sub("", heading).strip()
            last = self._headings[-1] if self._headings else name
            if name != last and name in self._headings:
                self.lasting = (
                    f"it prints grids under several headings, {last[:30]!r} and {name[:30]!r}; "
                    "give each its sensor under [sensors] in a file, PORT#FILE.toml"
                )
                return self.lasting
            self._headings.append(name)
            self._apart = self._apart + 1 if self._differ(values) else 0
            self._before.append(values)
            if self._apart > 2 * TURNS:
                self.lasting = TWO.format("each is like the last but one, not like the last")
        return self.lasting

    def _differ(self, values: list[int]) -> bool:
        """Is a grid far from the last and near the one before it?"""
        if len(self._before) < 2 or any(len(b) != len(values) for b in self._before):
            return False
        older, last = self._before
        near = sorted(abs(a - b) for a, b in zip(values, older, strict=True))[len(values) // 2]
        far = sorted(abs(a - b) for a, b in zip(values, last, strict=True))[len(values) // 2]
        return far > APART and far > 8 * near

    def of_statuses(self, codes: list[int]) -> str:
        """What is wrong with a frame's statuses as printed; empty: nothing."""
        how, seen = self._how, set(codes) - {NO_TARGET}
        if len(codes) < FEWEST:
            return ""  # of another kind of sensor, with codes of its own
        if seen.isdisjoint(how.valid) and 0 in seen and seen.isdisjoint(GOOD) and how.own_codes:
            return (
                "its statuses are 0 and never 5 or 9; if 0 means valid, as in ST's Cube examples, "
                "name PORT#st-cube or #st-cube-plain, or write valid = [0] in a file"
            )
        if not how.own_codes and VALID in seen:
            return (
                f"it has status {VALID}, the sensor's own for valid, and the format says that "
                f"{', '.join(map(str, how.valid))} is; name another format"
            )
        if seen & {*how.valid, *GOOD}:
            self._good, self._bad = True, 0
        elif seen:
            self._bad += 1
        if not self._good and self._bad > BAD:
            several = ", ".join(map(str, sorted(seen)[:4]))
            return f"no zone ever had a status that counts as valid (they are {several}); " + WHICH
        return ""
