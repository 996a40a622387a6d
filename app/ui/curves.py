"""The last half minute in rows, for the charts and for a table: each row as it was then.

What was asked for stands beside what came of it, row by row, so that a setting that is changed
later changes no past.
"""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from app.control.registry import kind_of
from app.messages import Array, Mode, Snapshot
from app.ui.pacing import Every
from app.ui.words import MOVING, doing_words

PERIOD = 0.1  # [s] between two rows
SPAN = 30.0  # [s]
LENGTH = int(SPAN / PERIOD)
FREE, SLOWED, PUSHED, BLOCKED, STOPPED = "free", "slowed", "pushed back", "blocked", "stopped"
COLUMNS = (
    "time_s", "can_give_way_m", "cannot_give_way_m", "kept_m", "begins_m", "ghost_m",
    "separation_m", "jump_m", "tick_ms", "late_ms", "period_ms", "speed_limit_share",
)  # fmt: skip
AT = {name: i for i, name in enumerate(COLUMNS)}


class Said(NamedTuple):
    """What the controller did at one row: its kind, one of those above, and the page's words."""

    kind: str
    words: str


class Curves:
    """The rows, the newest last; `joints` further columns are shares of the joints' limits."""

    def __init__(self, links: Sequence[str], qd_max: Array) -> None:
        """links: as the page calls them.   qd_max: (n,) [rad/s]."""
        self._links, self._qd_max, self._pace = links, qd_max, Every(PERIOD)
        self.rows = np.full((LENGTH, len(COLUMNS) + len(qd_max)), np.nan)
        self.said: deque[Said] = deque(maxlen=LENGTH)
        self._worst = np.zeros(3)  # jump, tick, lateness since the last row

    def take(self, snapshot: Snapshot) -> bool:
        """Take note of a snapshot; is there a new row?"""
        t = snapshot.timing
        now = [snapshot.jump, 1e3 * sum(t.rooms.values()), 1e3 * t.lateness]
        self._worst = np.maximum(self._worst, now)
        if not self._pace.due(snapshot.stamp):
            return False
        row = np.concatenate([self._row(snapshot), self._shares(snapshot)])
        self._worst = np.zeros(3)
        if not self.rows[-1, 0] <= row[0]:  # the first one, or the clock was set back
            self.rows[:] = np.nan
            self.said.clear()
        self.rows[:-1] = self.rows[1:]
        self.rows[-1] = row
        self.said.append(said(snapshot, self._links))
        return True

    def column(self, name: str) -> Array:
        """(LENGTH,) of one of `COLUMNS`, in its unit; NaN where there was no such thing."""
        return np.asarray(self.rows[:, AT[name]])

    def joints(self) -> Array:
        """(LENGTH, n) speeds as shares of the joints' own limits."""
        return self.rows[:, len(COLUMNS) :]

    def csv(self, joints: Sequence[str]) -> str:
        """The rows with a line of names, and the words of each."""
        names = [*COLUMNS, *(f"speed_share_{j}" for j in joints), "controller"]
        lines = [",".join(names)]
        known = self.rows[np.isfinite(self.rows[:, 0])]
        for row, what in zip(known, list(self.said)[-len(known) :], strict=False):
            words = what.words.replace('"', "'")
            cells = ["" if np.isnan(v) else f"{v:.6g}" for v in row]
            lines.append(",".join([*cells, f'"{words}"']))
        return "\n".join(lines) + "\n"

    def _row(self, snapshot: Snapshot) -> list[float]:
        near, params = snapshot.nearness, snapshot.params
        kept, begins = kind_of(params.mode).distances(params) or (np.nan, np.nan)
        ghost = snapshot.ghost.distance if snapshot.ghost is not None else np.nan
        needed, rate = snapshot.command.protective, snapshot.timing.rate
        return [
            snapshot.stamp,
            _finite(near.yields.distance),
            _finite(near.stays.distance),
            kept,
            begins,
            _finite(ghost),
            needed if needed > 0.0 else np.nan,
            *self._worst,
            1e3 / rate if rate > 0.0 else np.nan,
            params.joint_speed,
        ]

    def _shares(self, snapshot: Snapshot) -> Array:
        return np.abs(snapshot.joints.qd) / self._qd_max


def _finite(distance: float) -> float:
    return distance if np.isfinite(distance) else np.nan


def said(snapshot: Snapshot, links: Sequence[str]) -> Said:
    """What the controller does, as a kind and in words."""
    mode = snapshot.status.mode
    if mode not in MOVING:
        reason = snapshot.status.reason
        word = "Idle" if mode is Mode.IDLE else "Stopped"
        return Said(STOPPED, f"{word}: {reason}" if reason else word)
    words = doing_words(snapshot, links)
    if snapshot.nearness.blocked > 0.0:
        return Said(BLOCKED, words)
    if snapshot.command.activation <= 0.0:
        return Said(FREE, words)
    return Said(PUSHED if snapshot.command.reference > 0.0 else SLOWED, words)
