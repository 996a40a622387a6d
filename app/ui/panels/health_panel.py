"""How well it runs: rates, lateness, the rooms' milliseconds, the sensors, the verdicts."""

from collections import deque
from collections.abc import Sequence
from html import escape

import numpy as np
import viser

from app.messages import SensorHealth, Snapshot, Verdict
from app.perception.unable import Unable
from app.ui.colours import HEALTH, css
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.traffic import Traffic

PERIOD = 0.5  # [s]
MEMORY = 300  # snapshots seen, about 10 s: the percentiles are over these

Rows = list[tuple[str, str]]


class HealthPanel:
    """Four small tables, and one of the sensors that cannot see, at most twice a second.

    They are HTML: Markdown is compiled anew in the browser at every change.
    """

    def __init__(self, server: viser.ViserServer, engine: Engine, traffic: Traffic) -> None:
        self._engine, self._traffic, self._pace = engine, traffic, Every(PERIOD)
        self._names = tuple(s.name for s in engine.skin.sensors)
        self._lateness: deque[float] = deque(maxlen=MEMORY)
        self._ticks: deque[tuple[float, int]] = deque(maxlen=MEMORY)
        self.table = server.gui.add_html("")

    def update(self, snapshot: Snapshot) -> None:
        self._lateness.append(snapshot.timing.lateness)
        if self._ticks and self._ticks[-1][1] > snapshot.tick:  # started anew
            self._ticks.clear()
        self._ticks.append((snapshot.stamp, snapshot.tick))
        if self._pace.due(snapshot.stamp):
            self.table.content = (
                table("Loop", self._loop(snapshot))
                + table("Sensors", self._sensors(snapshot))
                + blind_table(snapshot, self._names)
                + table("Points", points(snapshot))
                + table("Page", self._page())
            )

    def _loop(self, snapshot: Snapshot) -> Rows:
        (t0, n0), (t1, n1) = self._ticks[0], self._ticks[-1]
        rate = f"{(n1 - n0) / (t1 - t0):.0f} Hz" if t1 > t0 else "-"
        p50, p99 = 1000.0 * np.percentile(self._lateness, [50, 99])
        rooms = snapshot.timing.rooms
        total = sum(rooms.values())
        late = ("late, p50 / p99", f"{p50:.2f} / {p99:.2f} ms")
        if not rooms:  # of a recording: how long it took then is not known
            return [("ticks", rate), late]
        return [
            ("ticks", rate),
            ("priority", "real time" if snapshot.timing.preferred else "ordinary"),
            late,
            ("one tick", f"{1000.0 * total:.2f} ms"),
            *((f"&emsp;{escape(room)}", f"{1000.0 * s:.2f} ms") for room, s in rooms.items()),
        ]

    def _sensors(self, snapshot: Snapshot) -> Rows:
        ages = snapshot.stamp - snapshot.cloud.stamp
        spoken = ages[np.isfinite(ages)]
        age = "-"
        if len(spoken):
            age = f"{1000.0 * spoken.min():.0f} / {1000.0 * spoken.max():.0f} ms"
        counts = np.bincount(snapshot.health, minlength=len(SensorHealth))
        states = " ".join(
            f'<span style="color:{css(HEALTH[h])}">&#9679;</span> {counts[h]} {h.name.lower()}'
            for h in SensorHealth
            if counts[h]
        )
        return [
            ("source", escape(self._engine.source)),
            ("health", states),
            ("frames a second", f"{snapshot.rate.sum():.0f}"),
            ("age, newest / oldest", age),
            ("measured to used, median / worst", latency(snapshot)),
            *((escape(name), escape(words)) for name, words in snapshot.inputs),
        ]

    def _page(self) -> Rows:
        return [
            ("messages a frame", str(self._traffic.messages)),
            ("bytes a frame", f"{self._traffic.bytes / 1000.0:.1f} kB"),
        ]


def latency(snapshot: Snapshot) -> str:
    """From a frame's measurement to the tick that used it, over the sensors that speak."""
    delay = snapshot.delay[np.isfinite(snapshot.delay)]
    if not len(delay):
        return "-"
    return f"{1000.0 * np.median(delay):.0f} / {1000.0 * delay.max():.0f} ms"


def points(snapshot: Snapshot) -> Rows:
    """How many slots each verdict has; those with none are left out."""
    counts = np.bincount(snapshot.cloud.verdict, minlength=len(Verdict))
    return [(v.name.lower().replace("_", " "), str(counts[v])) for v in Verdict if counts[v]]


def blind_table(snapshot: Snapshot, names: Sequence[str]) -> str:
    """The sensors that cannot tell, by reason, and what it costs; empty if all can."""
    if not snapshot.unable.any():
        return ""
    unable: list[int] = snapshot.unable.tolist()
    rows = [
        (u.words, escape(", ".join(n for n, v in zip(names, unable, strict=True) if v == u)))
        for u in Unable
        if u is not Unable.SEES and u in unable
    ]
    share = f"{100.0 * snapshot.blind:.0f} % of the skin; the arm stops at 50 %"
    speed = f"{100.0 * snapshot.command.unseen:.0f} %"
    return table("Cannot see", [*rows, ("unseen", share), ("speed left", speed)])


def table(title: str, rows: Rows) -> str:
    """A compact table; values may hold HTML and are escaped by whoever made them."""
    cell = "padding:0.05em 0"
    body = "".join(
        f'<tr><td style="{cell};opacity:0.7">{name}</td>'
        f'<td style="{cell};text-align:right">{value}</td></tr>'
        for name, value in rows
    )
    return (
        '<table style="width:92%;margin:0 4% 0.7em;font-size:0.8em;'
        'border-collapse:collapse;font-variant-numeric:tabular-nums">'
        f'<tr><th colspan="2" style="text-align:left">{title}</th></tr>{body}</table>'
    )
