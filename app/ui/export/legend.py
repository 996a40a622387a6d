"""What is seen in a film, in words and colours; each entry shows and hides its part of it."""

from dataclasses import dataclass, field

import numpy as np

from app.messages import SensorHealth, Snapshot, Verdict
from app.ui.colours import (
    ALARM,
    CALM,
    GHOST,
    GREY,
    HEALTH,
    KNOWN,
    POINT,
    REMEMBERED,
    RGB,
    WARN,
    css,
)
from app.ui.scene.cloud_view import BELIEVED, WORDS

HEALTH_WORDS = {
    SensorHealth.ABSENT: "no source",
    SensorHealth.WAITING: "has not spoken yet",
    SensorHealth.GOOD: "speaks",
    SensorHealth.POOR: "mostly bad values",
    SensorHealth.STALE: "silent",
    SensorHealth.FROZEN: "frozen",
    SensorHealth.SATURATED: "covered",
    SensorHealth.SLOW: "slow",
}


@dataclass(frozen=True)
class Entry:
    """nodes: pattern of the names in the scene that it shows and hides; empty: it only tells.

    shape: 'dot' of points, 'line', 'area' of bodies, 'cone' of sensors.
    """

    label: str
    help: str
    colours: tuple[RGB, ...]
    nodes: str = ""
    shape: str = "dot"
    on: bool = True


@dataclass
class Legend:
    """Fed with every picture; only what was there is told."""

    _verdicts: set[int] = field(default_factory=set)
    _health: set[int] = field(default_factory=set)
    _seen: set[str] = field(default_factory=set)

    def picture(self, snapshot: Snapshot) -> None:
        measured = np.isfinite(snapshot.cloud.points[:, 0])
        self._verdicts.update(np.unique(snapshot.cloud.verdict[measured]).tolist())
        self._health.update(np.unique(snapshot.health).tolist())
        there = {
            "memory": len(snapshot.memory) > 0,
            "pair": snapshot.pairs.closest >= 0,
            "ghost": snapshot.ghost is not None,
            "world": len(snapshot.world) > 0,
            "blind": bool(snapshot.unable.any()),
            "ring": snapshot.command.protective > 0.0,
            "learned": len(snapshot.background.known) > 0,
        }
        self._seen.update(name for name, so in there.items() if so)

    def entries(self, cell: bool) -> list[Entry]:
        """In the order of importance; `cell`: something is known of the place."""
        out = [
            Entry(
                "Closest pair", "from the nearest point of the world to the arm; green: free, red: "
                "the avoidance acts fully", (CALM, WARN, ALARM), "^/pair/(closest|distance)$",
                "line",
            )
        ] if "pair" in self._seen else []  # fmt: skip
        out += [self._points(v) for v in POINT if v in BELIEVED and v in self._verdicts]
        if "memory" in self._seen:
            words = "points that have left the field of view and still count"
            out.append(Entry("Remembered points", words, (REMEMBERED,), "^/memory$"))
        out.append(self._sensors())
        if "ghost" in self._seen:
            words = "the other controller's arm"
            out.append(Entry("Ghost", words, (GHOST,), "^/ghost$", "area"))
        if "blind" in self._seen:
            words = "what sensors should see and cannot"
            out.append(Entry("Blind cones", words, (ALARM,), "/blind-[0-9]+$", "cone"))
        if "ring" in self._seen:
            words = "protective separation distance; red: something is nearer"
            out.append(Entry("Separation", words, (GREY, ALARM), "^/separation$", "line"))
        if cell or "learned" in self._seen:
            words = "known and static: no obstacle, and the arm stays out of it"
            out.append(Entry("Known cell", words, (KNOWN,), "^/cell$", "line"))
        if "world" in self._seen:
            words = "what is really there; the arm knows of it only what its skin sees"
            out.append(Entry("Bodies", words, ((122, 158, 126),), "^/world$", "area"))
        axes = ((204, 0, 0), (0, 136, 0), (0, 0, 204))
        out.append(Entry("Goal", "where the tool shall be", axes, "^/goal$", "line"))
        out += [self._points(v, False) for v in POINT if v not in BELIEVED and v in self._verdicts]
        return out

    def _points(self, verdict: Verdict, on: bool = True) -> Entry:
        label, words = WORDS[verdict]
        label = "Ghost points" if verdict is Verdict.GHOST else label  # not the ghost's
        nodes = f"^/cloud/{verdict.name.lower()}$"
        return Entry(label, words, (POINT[verdict],), nodes, on=on)

    def _sensors(self) -> Entry:
        states = [h for h in SensorHealth if h in self._health]
        words = "by health: " + ", ".join(f"{css(HEALTH[h])} {HEALTH_WORDS[h]}" for h in states)
        colours = tuple(HEALTH[h] for h in states)
        return Entry("Sensors", words, colours, "/sensors(-[0-9]+)?$", "cone")
