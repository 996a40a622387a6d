"""What the charts below a film show: distances and activation, and when something happened.

Every tick is looked at. Between two pictures the smallest distance and the largest activation
count, so that a moment of danger is in the chart also where no picture shows it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from app.control.registry import kind_of
from app.messages import Array, Mode, Snapshot, Verdict
from app.ui.words import WORD, closest_words, link_words

# columns: the whole body's distance, the controller's own, kept, begins at, the ghost's, separation
# [m], NaN where there is none; activation
DISTANCE, OWN, KEPT, BEGINS, GHOST, SEPARATION, ACTIVATION = range(7)
NAMES = ("distance", "own", "kept", "begins", "ghost", "separation", "activation")


@dataclass(frozen=True)
class Mark:
    """Something that happened: kind is 'stop', 'mode', 'controller', 'touch' or 'waypoint'."""

    time: float
    kind: str
    words: str


@dataclass(frozen=True)
class Nearest:
    """The smallest distance of a clip: [m] of which link, [s] from the clip's beginning."""

    distance: float = np.inf
    link: str = ""
    time: float = 0.0


@dataclass
class Curves:
    """Fed with every tick; `picture` closes the span since the last picture."""

    links: Sequence[str]  # of the robot
    times: list[float] = field(default_factory=list)  # [s] of the pictures, the first at 0
    rows: list[Array] = field(default_factory=list)
    words: list[tuple[str, str]] = field(default_factory=list)  # state and closest, of a picture
    marks: list[Mark] = field(default_factory=list)
    nearest: Nearest = Nearest()
    _span: list[Array] = field(default_factory=list)
    _began: float | None = None
    _before: Snapshot | None = None

    def tick(self, snapshot: Snapshot) -> None:
        """Take notice of one tick."""
        if self._began is None:
            self._began = snapshot.stamp
        self._span.append(sample(snapshot))
        body, now = snapshot.body, snapshot.stamp - self._began
        if body.minimum < self.nearest.distance:
            link = link_words(self.links[int(body.link[body.closest])])
            self.nearest = Nearest(body.minimum, link, now)
        if self._before is not None:
            self.marks.extend(happened(self._before, snapshot, now))
        self._before = snapshot

    def picture(self, snapshot: Snapshot) -> None:
        """The tick of `snapshot`, noticed already, is one that the film shows."""
        assert self._began is not None, "no tick has been noticed"
        self.times.append(snapshot.stamp - self._began)
        self.rows.append(worst(np.array(self._span)))
        self._span.clear()
        names = [link_words(link) for link in self.links]
        mode = WORD[snapshot.status.mode][0]
        self.words.append((mode, closest_words(snapshot, names)))

    def table(self) -> dict[str, list[float | None]]:
        """The columns by name, in their units; None where there is no value."""
        rows = np.array(self.rows).reshape(-1, len(NAMES))
        own, body = rows[:, OWN], rows[:, DISTANCE]
        both = np.isfinite(own) & np.isfinite(body)
        if not np.any(np.abs(own - body)[both] > 0.01):
            rows = rows.copy()
            rows[:, OWN] = np.nan  # the controller looks at the same distance
        return {name: plain(rows[:, k], 4) for k, name in enumerate(NAMES)}


def sample(snapshot: Snapshot) -> Array:
    """(7,) one row, in the order of `NAMES`."""
    p, command = snapshot.params, snapshot.command
    kept, begins = kind_of(p.mode).distances(p) or (np.nan, np.nan)
    ghost = snapshot.ghost.distance if snapshot.ghost is not None else np.nan
    row = np.array(
        [
            snapshot.body.minimum, snapshot.pairs.minimum, kept, begins, ghost,
            command.protective or np.nan, command.activation,
        ]
    )  # fmt: skip
    row[~np.isfinite(row)] = np.nan
    return row


def worst(rows: Array) -> Array:
    """(7,) of the rows (n, 7) of one span: smallest distances, the largest activation."""
    out: Array = rows[-1].copy()
    for k in (DISTANCE, OWN, GHOST):
        some = rows[np.isfinite(rows[:, k]), k]
        out[k] = some.min() if len(some) else np.nan
    out[ACTIVATION] = np.nanmax(rows[:, ACTIVATION])
    return out


def happened(before: Snapshot, now: Snapshot, time: float) -> list[Mark]:
    """What is worth a mark between two ticks that follow each other."""
    marks = []
    if now.status.mode is not before.status.mode:
        word, _ = WORD[now.status.mode]
        kind = "stop" if now.status.mode is Mode.STOPPED else "mode"
        marks.append(Mark(time, kind, f"{word}: {now.status.reason}"))
    if now.params.mode != before.params.mode:
        marks.append(Mark(time, "controller", f"Controller: {kind_of(now.params.mode).label}"))
    if now.reached != before.reached and now.reached:
        marks.append(Mark(time, "waypoint", f"Waypoint {now.reached} reached"))
    touched = (now.cloud.verdict == Verdict.CONTACT).any()
    if touched and not (before.cloud.verdict == Verdict.CONTACT).any():
        marks.append(Mark(time, "touch", "A sensor is touched"))
    return marks


def plain(values: Array, digits: int) -> list[float | None]:
    """Numbers as JSON has them: rounded, None for what is not finite."""
    return [round(float(v), digits) if np.isfinite(v) else None for v in values]


def as_facts(curves: Curves) -> dict[str, Any]:
    """All of it, for the document."""
    near, marks = curves.nearest, curves.marks
    return {
        "times": [round(t, 4) for t in curves.times],
        "curves": curves.table(),
        "words": curves.words,
        "marks": [{"time": round(m.time, 3), "kind": m.kind, "words": m.words} for m in marks],
        "nearest": {
            "distance": round(near.distance, 4) if np.isfinite(near.distance) else None,
            "link": near.link,
            "time": round(near.time, 3),
        },
    }
