"""The last half minute: distances, what the controller did, speeds, jumps, and the ticks.

The mouse over a chart reads its values in the legend beneath; over the strip, the words of then.
"""

from collections.abc import Sequence
from html import escape
from itertools import groupby
from typing import Any

import numpy as np
import viser
from viser import uplot

from app.messages import Array, Snapshot, Verdict
from app.ui.colours import ALARM, CALM, CHOSEN, DARK, GHOST, GREY, NEAR, POINT, RGB, WARN, css
from app.ui.curves import (
    BLOCKED,
    COLUMNS,
    FREE,
    LENGTH,
    PUSHED,
    SLOWED,
    SPAN,
    STOPPED,
    Curves,
    Said,
)
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.words import link_words

SENT = 0.25  # [s] between two pictures
CEILING = 100.0  # [cm] farther, or nothing in sight, is drawn at the top
JUMP = 50.0  # [cm] larger jumps are drawn at the top
TICK = 12.0  # [ms] longer ticks are drawn at the top: three of 250 Hz
LEFT, RIGHT = 42, 24  # pixels that a chart needs beside its field, as viser draws it
AXIS = {"size": LEFT, "font": "11px sans-serif"}
TIME = {"size": 34, "font": "11px sans-serif"}
STRIP: dict[str, RGB] = {
    FREE: CALM, SLOWED: NEAR, PUSHED: (190, 90, 180), BLOCKED: WARN, STOPPED: GREY,
}  # fmt: skip
JOINTS: tuple[RGB, ...] = (
    (0, 114, 178), (230, 159, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (213, 94, 0),
    (120, 120, 60),
)  # Okabe and Ito's, apart for every eye  # fmt: skip
JUMPS = (
    "A jump: the point that the avoidance acts on has moved from one part of the arm to another "
    "between two ticks. A few are usual where two parts are equally near; many make the arm twitch."
)
SAVE = "Save a picture"
# the charts' own pixels, one beneath the other, as a file of the browser
PICTURE = """
const a=[...document.querySelectorAll('.uplot')].filter(e=>e.offsetParent);
const c=a.map(e=>e.querySelector('canvas')),r=devicePixelRatio||1;
const o=document.createElement('canvas');const g=26*r;
o.width=Math.max(...c.map(e=>e.width));o.height=c.reduce((s,e)=>s+e.height+g,0);
const x=o.getContext('2d');x.fillStyle='#fff';x.fillRect(0,0,o.width,o.height);
x.fillStyle='#222';x.font=13*r+'px sans-serif';let y=0;
c.forEach((e,i)=>{const t=a[i].querySelector('.u-title');x.fillText(t?t.textContent:'',8*r,y+17*r);
x.drawImage(e,0,y+g);y+=e.height+g});
const l=document.createElement('a');l.download='flinch-plots.png';l.href=o.toDataURL();l.click()
""".replace("\n", "")


class PlotPanel:
    """Four charts, a strip of words, and what can be kept of them."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        links = [link_words(link) for link in engine.robot.links]
        self.curves = Curves(links, engine.robot.qd_max)
        self._joints = tuple(engine.robot.joints)
        self._sent = Every(SENT)
        self._add_keeping(server.gui)
        self.distance = _chart(server.gui, "Distance [cm]", CEILING, 165, (
            ("can give way", POINT[Verdict.KEPT], 2.0, None),
            ("cannot", GREY, 1.5, None),
            ("kept", DARK, 1.0, (6, 4)),
            ("begins", CHOSEN, 1.0, (2, 4)),
            ("ghost", GHOST, 1.5, None),
            ("separation", ALARM, 1.0, (2, 3)),
        ))  # fmt: skip
        self.strip = server.gui.add_html(strip_html([]))
        colours = zip(self._joints, JOINTS * len(self._joints), strict=False)
        self.speed = _chart(server.gui, "Joint speeds [% of their limits]", 100.0, 135, (
            *((short(name), colour, 1.5, None) for name, colour in colours),
            ("allowed", DARK, 1.0, (6, 4)),
        ))  # fmt: skip
        self.jump = _chart(server.gui, "Largest jump of the control point [cm]", JUMP, 95, (
            ("jump", POINT[Verdict.BEHIND], 1.5, None),
        ))  # fmt: skip
        server.gui.add_html(
            f'<div style="padding:0 10px 0.6em;font-size:0.8em;opacity:0.8">{JUMPS}</div>'
        )
        self.tick = _chart(server.gui, "Longest tick, and how late it began [ms]", TICK, 110, (
            ("tick", CHOSEN, 1.5, None), ("late", WARN, 1.5, None), ("period", DARK, 1.0, (6, 4)),
        ))  # fmt: skip

    def update(self, snapshot: Snapshot) -> None:
        self.curves.take(snapshot)
        if not self.pause.value and self._sent.due(snapshot.stamp):
            self._show()

    def _add_keeping(self, gui: viser.GuiApi) -> None:
        self.pause = gui.add_checkbox(
            "Pause", False, hint="the charts stand still; what happens meanwhile is kept"
        )
        self.save = gui.add_button("Save as CSV", icon=viser.Icon.TABLE_EXPORT, color="gray")
        gui.add_html(
            f'<div style="padding:0 10px 0.5em"><button style="all:unset;cursor:pointer;'
            f"width:100%;text-align:center;border:1px solid currentColor;border-radius:4px;"
            f'padding:0.3em 0;font-size:0.85em;box-sizing:border-box" onclick="{PICTURE}">'
            f"{SAVE} (PNG)</button></div>"
        )

        @self.save.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                table = self.curves.csv(self._joints).encode()
                event.client.send_file_download("flinch-plots.csv", table, save_immediately=True)

    def _show(self) -> None:
        c = self.curves
        time = c.column("time_s") - c.rows[-1, 0]
        before = np.isnan(time)  # there was no row yet
        first = time[~before][0]
        time[before] = np.linspace(first - SPAN, first, before.sum(), endpoint=False)
        distances = [_drawn(100.0 * c.column(name), CEILING) for name in COLUMNS[1:7]]
        # nothing in sight is far away; that nothing is there which cannot give way is no line
        distances[0][np.isnan(distances[0]) & ~before] = CEILING
        self.distance.data = (time, *distances)
        self.strip.content = strip_html(list(c.said))
        limit = 100.0 * c.column("speed_limit_share")
        self.speed.data = (time, *(_drawn(100.0 * s, 100.0) for s in c.joints().T),
                           _drawn(limit, 100.0))  # fmt: skip
        self.jump.data = (time, _drawn(100.0 * c.column("jump_m"), JUMP))
        ticks = [_drawn(c.column(name), TICK) for name in ("tick_ms", "late_ms", "period_ms")]
        self.tick.data = (time, *ticks)


def short(joint: str) -> str:
    """`shoulder_pan_joint` as `shoulder pan`."""
    return " ".join(w for w in joint.split("_") if w != "joint") or joint


def strip_html(said: Sequence[Said]) -> str:
    """What the controller did as a strip beneath the first chart, the newest at its right end, and
    what its colours mean; the words of each stretch come when the mouse rests on it."""
    place, out = LENGTH - len(said), []
    for what, run in groupby(said):
        long = len(list(run))
        out.append(
            f'<rect x="{place}" width="{long}" height="10" fill="{css(STRIP[what.kind])}">'
            f"<title>{escape(what.words)}</title></rect>"
        )
        place += long
    key = " ".join(
        f'<span style="white-space:nowrap"><i style="display:inline-block;width:9px;height:9px;'
        f'background:{css(colour)}"></i> {kind}</span>'
        for kind, colour in STRIP.items()
    )
    now = escape(said[-1].words) if said else ""
    return (
        f'<div data-strip="1" style="padding:0 {RIGHT + 10}px 0 {LEFT + 10}px">'
        f'<svg viewBox="0 0 {LENGTH} 10" preserveAspectRatio="none" '
        f'style="display:block;width:100%;height:14px">{"".join(out)}</svg></div>'
        f'<div style="padding:0.2em 10px 0.6em;font-size:0.75em;line-height:1.4">{key}'
        f'<div style="min-height:1.4em;font-weight:600">{now}</div></div>'
    )


def _chart(
    gui: viser.GuiApi, title: str, top: float, height: int,
    lines: Sequence[tuple[str, RGB, float, tuple[int, int] | None]],
) -> viser.GuiUplotHandle:  # fmt: skip
    """A chart of half a minute; lines: name, colour, width and dash of each."""
    series = [uplot.Series(label="s")]
    for name, colour, width, dash in lines:
        one = uplot.Series(label=name, stroke=css(colour), width=width)
        series.append(one if dash is None else {**one, "dash": dash})
    x = np.linspace(-SPAN, 0.0, LENGTH)
    return gui.add_uplot(
        (x, *(np.full(LENGTH, np.nan) for _ in lines)),
        tuple(series),
        title=title,
        scales={
            "x": {"time": False, "range": (-SPAN, 0.0)},
            "y": {"range": (0.0, 1.08 * top)},
        },
        axes=(uplot.Axis(**TIME), uplot.Axis(**AXIS)),  # type: ignore[typeddict-item]
        legend=uplot.Legend(show=True, live=True),
        height=height,
    )


def _drawn(curve: Array, top: float) -> Array:
    """What is drawn of a curve: no higher than the top; NaN, where it is missing, is a gap."""
    return np.minimum(curve, top)
