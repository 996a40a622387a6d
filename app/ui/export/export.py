"""A run into a clip: what `flinch export` and the gallery do with every tick of it."""

from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass

from app.control.registry import kind_of
from app.errors import ConfigError
from app.messages import Snapshot
from app.ui.export.curves import Curves, as_facts
from app.ui.export.document import Clip
from app.ui.export.eye import Eye, choose_eye
from app.ui.export.film import Arm, Film
from app.ui.export.legend import Entry, Legend

PICTURES = 20.0  # [1/s] that are shown, unless a stride is given; clouds change 10 times a second
LONGEST = 120.0  # [s] of a clip: all of it is in the memory of whoever opens the page


@dataclass(frozen=True)
class Part:
    """What of a run is shown: from, to [s] since its beginning; every `stride`-th tick, 0: 20/s."""

    begin: float = 0.0
    end: float = float("inf")
    stride: int = 0

    def __post_init__(self) -> None:
        if self.stride < 0:
            raise ConfigError(f"stride = {self.stride}; give 1 or more ticks, or leave it out")
        if not 0.0 <= self.begin < self.end:
            raise ConfigError(
                f"from = {self.begin:g}, to = {self.end:g}; give seconds since the beginning, "
                "the first before the second"
            )


@dataclass(frozen=True, eq=False)
class Exported:
    """A clip and what was found on the way; `length` [s], `nearest` at the smallest distance."""

    clip: Clip
    entries: list[Entry]
    curves: Curves
    eye: Eye
    first: Snapshot
    nearest: Snapshot
    length: float


def exported(
    arm: Arm, run: Iterable[Snapshot], stride: int = 0, name: str = "", closer: float = 1.0
) -> Exported:
    """Every tick of `run`, in its order, into a clip.

    name: in words, default: its controller's.   closer: divides the distance of the eye.

    Raises ConfigError for a run without a tick, and for one that is too long.
    """
    with ExitStack() as held:
        cut: _Cut | None = None
        for snapshot in run:
            if cut is None:
                cut = _Cut(arm, snapshot, stride, closer)
                held.enter_context(cut.film)
            cut.take(snapshot)
        if cut is None:
            raise ConfigError("there is no tick to show; choose another --from and --to")
        return cut.done(name)


class _Cut:
    """A clip in the making."""

    def __init__(self, arm: Arm, first: Snapshot, stride: int, closer: float) -> None:
        self._arm, self._stride, self._first = arm, stride, first
        self._curves, self._legend = Curves(arm.robot.links), Legend()
        self._eye = choose_eye(first, closer)
        self._ticks, self._due = 0, first.stamp
        self._nearest = self._last = first
        self.film = Film(arm, self._eye)

    def take(self, snapshot: Snapshot) -> None:
        """The next tick."""
        if snapshot.stamp - self._first.stamp > LONGEST:
            raise ConfigError(
                f"the clip is longer than {LONGEST:g} s, too much for a page; choose a part of it "
                "with --from and --to"
            )
        self._curves.tick(snapshot)
        if snapshot.body.minimum < self._nearest.body.minimum:
            self._nearest = snapshot
        if self._ticks % self._stride == 0 if self._stride else snapshot.stamp >= self._due:
            self._due = snapshot.stamp + 0.99 / PICTURES  # ticks are not quite even
            self._last = snapshot
            for taker in (self._curves.picture, self._legend.picture, self.film.show):
                taker(snapshot)
        self._ticks += 1

    def done(self, name: str) -> Exported:
        """All of it."""
        times, cell = self._curves.times, self._arm.cell
        length = self._last.stamp - self._first.stamp
        rest = length / (len(times) - 1) if len(times) > 1 else 1.0 / PICTURES
        clip = Clip(
            name or kind_of(self._first.params.mode).label,
            self.film.develop(rest),
            as_facts(self._curves),
        )
        entries = self._legend.entries(bool(cell.boxes or cell.planes))
        return Exported(
            clip, entries, self._curves, self._eye, self._first, self._nearest, length + rest
        )
