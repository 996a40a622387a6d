"""Figures of a whole recording for the plots, gathered as its ticks are computed."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.replay.figures import Figurer, Figures
from app.replay.timeline import Moment, Timeline

EVERY = 0.1  # [s] between two rows of figures


class Survey:
    """Watches a timeline from its first tick on.

    at:   (R,) ticks of the rows, one each `every` seconds.   time: (R,) [s] from the first tick.
    rows: (R, columns of `Figures`), NaN where nothing was computed yet.
    """

    def __init__(self, timeline: Timeline, every: float = EVERY) -> None:
        mind = timeline.mind
        self._timeline, self._figurer = timeline, Figurer(mind.brain.robot)
        self.ghostly = mind.ghost is not None
        times = np.asarray(timeline.recording.times)
        self.at = sampled(times, every)
        self.time: Array = times[self.at] - times[0]
        self.rows: Array = np.full((len(self.at), len(Figures._fields)), np.nan)
        self._filled = 0
        timeline.watch = self._see

    @property
    def done(self) -> bool:
        """Was all of it computed?"""
        return self._timeline.frontier == len(self._timeline)

    @property
    def share(self) -> float:
        """0..1 of it that was."""
        return self._timeline.frontier / len(self._timeline)

    def column(self, name: str) -> Array:
        """(R,) of one of the `Figures`."""
        column: Array = self.rows[:, Figures._fields.index(name)]
        return column

    def _see(self, i: int, moment: Moment) -> None:
        if self._filled < len(self.at) and self.at[self._filled] == i:
            self.rows[self._filled] = self._figurer.row(moment)
            self._filled += 1


def sampled(times: Array, every: float = EVERY) -> NDArray[np.intp]:
    """(R,) ticks: the first one of each `every` seconds; all of them if that is 0."""
    if every == 0.0:
        return np.arange(len(times))
    slot: NDArray[Any] = np.floor((times - times[0]) / every + 1e-9)
    return np.flatnonzero(np.diff(slot, prepend=slot[0] - 1.0) > 0.0)
