"""How far a study is, on standard error, with the time that is left."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

if TYPE_CHECKING:
    from app.studies.trial import TrialResult

EVERY = 10.0  # [s] between lines where there is no terminal


@dataclass
class Pace:
    """How far it is, told trial by trial.

    done, wanted: numbers of trials; those of before are done as well.
    left: [s] as long as the rest will take, if it is like what was done since the beginning.
    """

    clock: Callable[[], float] = time.monotonic
    done: int = 0
    wanted: int = 0
    left: float = 0.0
    _begun: float = field(init=False)
    _before: int | None = None

    def __post_init__(self) -> None:
        self._begun = self.clock()

    def update(self, done: int, wanted: int) -> None:
        """One more is done."""
        if self._before is None:
            self._before = done - 1
        self.done, self.wanted = done, wanted
        self.left = (self.clock() - self._begun) / (done - self._before) * (wanted - done)

    def words(self) -> str:
        """Such as '12 of 63 trials, about 4 min left'."""
        said = f"{self.done} of {self.wanted} trials"
        return said if self.done == self.wanted else f"{said}, about {_span(self.left)} left"


def _span(seconds: float) -> str:
    """A time in words, no finer than it is known."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


Show = Callable[["TrialResult", int, int], None]


@contextmanager
def shown(what: str, pace: Pace, quiet: bool) -> Iterator[Show]:
    """A bar on a terminal, else a line now and then; nothing there if `quiet`."""
    if sys.stderr.isatty():
        with _bar(what, pace) as show:
            yield show
    else:
        yield _lines(what, pace, quiet)


@contextmanager
def _bar(what: str, pace: Pace) -> Iterator[Show]:
    columns = TextColumn(what), BarColumn(), TextColumn("{task.fields[words]}")
    with Progress(*columns, console=Console(stderr=True)) as bars:
        task = bars.add_task(what, total=None, words="the first trials")

        def show(result: "TrialResult", done: int, wanted: int) -> None:
            pace.update(done, wanted)
            bars.update(task, completed=done, total=wanted, words=pace.words())

        yield show


def _lines(what: str, pace: Pace, quiet: bool) -> Show:
    last = pace.clock()

    def show(result: "TrialResult", done: int, wanted: int) -> None:
        nonlocal last
        pace.update(done, wanted)
        now = pace.clock()
        if not quiet and (now - last >= EVERY or done == wanted):
            last = now
            print(f"{what}: {pace.words()}", file=sys.stderr, flush=True)

    return show
