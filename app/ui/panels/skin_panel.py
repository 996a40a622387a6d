"""The skin: a small picture of what every sensor sees, and one sensor in full.

The pictures are one block of SVG, sent four times a second at most. Above each lies a button of
its own, so that mouse and keyboard reach it: viser's buttons are laid over the block by a rule of
style, and so are those over the zones of the single sensor.
"""

from html import escape
from typing import Any

import numpy as np
import viser

from app.actions import SpoilSensor, UseSensor
from app.messages import SensorHealth, Snapshot, Verdict
from app.perception.unable import SEEING, Unable
from app.sensing.spoiled import HOW, WELL
from app.ui.chosen import NOBODY, Chosen
from app.ui.colours import ALARM, GHOST, HEALTH, css
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.panels.assign import assign
from app.ui.panels.health_panel import Rows, table
from app.ui.scene.chosen_view import zone_of
from app.ui.verdicts import distances, explain, title
from app.ui.zone_maps import ACROSS, BAD, CELL, LABEL, Sheet, one, scale

REAL, SIMULATED = "real", "simulated"
PERIOD = 0.25  # [s]
SORTED = 2.0  # [s] between two looks for who is worst: what jumps about cannot be clicked
NO_SENSOR = "(click a map, or a cone in the scene)"
# viser's buttons over a picture: no look of their own, one in each field of a grid
OVERLAY = """
<style>
.{name}{{padding:0 10px}}
div:has(>.{name})+div{{margin-top:calc((100% - 20px)*-{high:.5f});position:relative;
padding-bottom:0}}
div:has(>.{name})+div>div>div:first-child{{display:none}}
div:has(>.{name})+div .mantine-Button-root{{all:unset;cursor:pointer;min-width:0!important;
box-sizing:border-box;display:flex;align-items:flex-end;justify-content:center;overflow:hidden;
font-size:9.5px;line-height:{line}px;color:{colour};aspect-ratio:{wide}/{tall}}}
div:has(>.{name})+div .mantine-Button-inner,div:has(>.{name})+div .mantine-Button-label
{{height:auto;min-width:0;overflow:hidden}}
div:has(>.{name})+div .mantine-Button-root:focus-visible{{outline:2px solid currentColor}}
div:has(>.{name})+div div:has(>.mantine-Button-root)
{{display:grid!important;grid-template-columns:repeat({across},1fr);gap:0!important}}
</style>
"""


class SkinPanel:
    """The sheet, the single sensor, and what can be done to it."""

    def __init__(
        self, server: viser.ViserServer, engine: Engine, chosen: Chosen, recorded: bool = False
    ) -> None:
        """recorded: nothing can be done to a sensor any more."""
        self._engine, self._skin, self._chosen = engine, engine.skin, chosen
        self._names = tuple(s.name for s in engine.skin.sensors)
        self._pace, self._sorting, self._recorded = Every(PERIOD), Every(SORTED), recorded
        self._last: Snapshot | None = None
        self._said: str | None = None
        self._grid = (0, 0)
        self.sheet = Sheet(engine.skin)
        self._add_sheet(server.gui)
        self._add_sensor(server.gui)
        self._listen()
        chosen.changed.append(self.refresh)

    def update(self, snapshot: Snapshot) -> None:
        self._last = snapshot
        if self._pace.due(snapshot.stamp):
            self.refresh()

    def refresh(self) -> None:
        """Show the last snapshot with what is chosen now."""
        snapshot = self._last
        if snapshot is None:
            return
        if self.worst.value and self._sorting.due(snapshot.stamp):
            self._arrange(worst_first(snapshot, self._skin.sensor_of))
        far = distances(snapshot.cloud, snapshot.T_base_link, self._skin)
        k, verdict = self._chosen.sensor, snapshot.cloud.verdict
        self.summary.content = summary_html(snapshot)
        svg = self.sheet.svg(far, verdict, dots(snapshot), k)
        self.maps.content = f'<div class="skin-maps">{svg}</div>'
        self._show_sensor(snapshot, k, far)

    # --- built once -----------------------------------------------------------------------

    def _add_sheet(self, gui: viser.GuiApi) -> None:
        self.summary = gui.add_html("")
        self.worst = gui.add_checkbox(
            "Worst first", False, hint="those that cannot see, then those with most useless zones"
        )
        tall = CELL + LABEL
        over = OVERLAY.format(
            name="skin-maps", high=self.sheet.rows * tall / (ACROSS * CELL), line=LABEL,
            colour="inherit", wide=CELL, tall=tall, across=ACROSS,
        )  # fmt: skip
        gui.add_html(over)
        self.maps = gui.add_html('<div class="skin-maps"></div>')
        self.map_buttons = gui.add_button_group("Maps", self._names)
        gui.add_html(scale())

    def _add_sensor(self, gui: viser.GuiApi) -> None:
        self.choice = gui.add_dropdown("Sensor", (NO_SENSOR, *self._names))
        self.spoil = gui.add_button_group(
            "Try it", tuple(HOW), visible=False,
            hint="; ".join(f"{how}: {words}" for how, words in HOW.items()),
        )  # fmt: skip
        self.feed = gui.add_button_group("Feed it from", (REAL, SIMULATED), visible=False)
        self.over_zones = gui.add_html("")
        self.zones = gui.add_html("", visible=False)
        self.zone_buttons = gui.add_button_group("Zones", ("1",), visible=False)
        self.words = gui.add_html("", visible=False)
        self.facts = gui.add_html("", visible=False)

    def _listen(self) -> None:
        @self.map_buttons.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            self._chosen.take_sensor(self._names.index(event.target.value))

        @self.zone_buttons.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            k = self._chosen.sensor
            if k != NOBODY:
                last = int(self._skin.first[k + 1]) - 1
                slot = int(self._skin.first[k]) + int(event.target.value) - 1
                self._chosen.take_zone(min(slot, last))

        @self.choice.on_update
        async def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                name = event.target.value
                k = self._names.index(name) if name in self._names else NOBODY
                self._chosen.take_sensor(k)

        @self.worst.on_update
        async def _(event: viser.GuiEvent[Any]) -> None:
            if not event.target.value:
                self._arrange(range(len(self._names)))
            self._sorting.anew()
            self.refresh()

        @self.spoil.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            if self._chosen.sensor != NOBODY:
                self._engine.post(SpoilSensor(self._chosen.sensor, event.target.value))

        @self.feed.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            if self._chosen.sensor != NOBODY:
                name = self._names[self._chosen.sensor]
                self._engine.post(UseSensor(name, event.target.value == REAL))

    # --- shown ----------------------------------------------------------------------------

    def _arrange(self, order: Any) -> None:
        order = tuple(order)
        if order != self.sheet.order:
            self.sheet.arrange(order)
            self.map_buttons.options = tuple(self._names[k] for k in order)

    def _show_sensor(self, snapshot: Snapshot, k: int, far: np.ndarray) -> None:
        some = k != NOBODY
        assign(self.choice, self._names[k] if some else NO_SENSOR)
        mixed = snapshot.real is not None and not self._recorded
        for control, visible in (
            (self.spoil, some and not self._recorded), (self.feed, some and mixed),
            (self.zones, some), (self.zone_buttons, some), (self.words, some), (self.facts, some),
        ):  # fmt: skip
            if control.visible != visible:
                control.visible = visible
        if not some:
            return
        rows, columns = grid = self._skin.sensors[k].type.grid
        mine, slot = self._skin.zones(k), self._chosen.slot
        if grid != self._grid:
            self._grid = grid
            self.zone_buttons.options = tuple(map(str, range(1, rows * columns + 1)))
            self.over_zones.content = OVERLAY.format(
                name="skin-zones", high=rows / columns, line=10, colour="transparent", wide=1,
                tall=1, across=columns,
            )  # fmt: skip
        zone = slot - mine.start if slot >= 0 else -1
        svg = one(far[mine], snapshot.cloud.verdict[mine], grid, zone)
        self.zones.content = f'<div class="skin-zones">{svg}</div>'
        self.words.content = self._words_html(snapshot, slot)
        self.facts.content = table(escape(self._names[k]), facts(snapshot, self._engine, k, far))

    def _words_html(self, snapshot: Snapshot, slot: int) -> str:
        """What became of the chosen zone; of constant height, whatever is said."""
        if slot < 0:
            body = "Click a zone, or a point in the scene: it is told why it is believed or not."
        else:
            zone = zone_of(snapshot, slot, self._engine, self._engine.cell)
            words = explain(zone)
            body = (
                f"<b>{escape(title(zone))}</b><br>{escape(words.said)}<br>"
                f'<span style="opacity:0.75">{escape(words.change)}</span>'
            )
        return (
            f'<div data-verdict="1" style="min-height:8.2em;padding:0.4em 10px;font-size:0.85em;'
            f'line-height:1.4">{body}</div>'
        )


def unseeing(snapshot: Snapshot, k: int) -> bool:
    """Can sensor k not tell what is before it?"""
    return len(snapshot.unable) > k and int(snapshot.unable[k]) not in map(int, SEEING)


def dots(snapshot: Snapshot) -> list[str]:
    """A colour for each sensor that needs a look: it cannot see, is not well, or was spoiled."""
    done = dict(snapshot.spoiled)
    out = []
    for k, health in enumerate(snapshot.health.tolist()):
        if unseeing(snapshot, k):
            out.append(css(ALARM))
        elif health != SensorHealth.GOOD:
            out.append(css(HEALTH[SensorHealth(health)]))
        else:
            out.append(css(GHOST) if k in done else "")
    return out


def useless(snapshot: Snapshot, sensor_of: np.ndarray) -> np.ndarray:
    """(K,) share of each sensor's zones whose distance is worth nothing."""
    bad = BAD[snapshot.cloud.verdict].astype(float)
    K = len(snapshot.health)
    return np.bincount(sensor_of, bad, K) / np.bincount(sensor_of, minlength=K)


def worst_first(snapshot: Snapshot, sensor_of: np.ndarray) -> list[int]:
    """The sensors by trouble: who cannot see, who is not well, whom a person has spoiled, and then
    by the share of useless zones."""
    share, done = useless(snapshot, sensor_of), dict(snapshot.spoiled)

    def trouble(k: int) -> tuple[bool, bool, bool, float]:
        ill = int(snapshot.health[k]) != SensorHealth.GOOD
        return unseeing(snapshot, k), ill, k in done, round(float(share[k]), 2)

    return sorted(range(len(share)), key=lambda k: (*(-x for x in trouble(k)), k))


def summary_html(snapshot: Snapshot) -> str:
    """How many sensors are well, and how many cannot see, in one line."""
    counts = np.bincount(snapshot.health, minlength=len(SensorHealth))
    words = [f"{counts[h]} {h.name.lower()}" for h in SensorHealth if counts[h]]
    blind = sum(unseeing(snapshot, k) for k in range(len(snapshot.health)))
    if blind:
        words.append(f'<b style="color:{css(ALARM)}">{blind} cannot see</b>')
    return f'<div style="padding:0 10px 0.3em;font-size:0.85em">Sensors: {", ".join(words)}</div>'


def facts(snapshot: Snapshot, engine: Engine, k: int, far: np.ndarray) -> Rows:
    """What is known of sensor k: what it is, how it is, what it sees, how well it is known."""
    skin, cloud = engine.skin, snapshot.cloud
    sensor, mine = skin.sensors[k], skin.zones(k)
    kind, doubt = sensor.type, skin.doubt
    verdict, seen = cloud.verdict[mine], far[mine][np.isfinite(far[mine])]
    counts = np.bincount(verdict, minlength=len(Verdict))
    state = SensorHealth(int(snapshot.health[k])).name.lower()
    if unseeing(snapshot, k):
        state += f", cannot see: {Unable(int(snapshot.unable[k])).words}"
    done = dict(snapshot.spoiled).get(k, WELL)
    where = "" if snapshot.real is None else f", {REAL if snapshot.real[k] else SIMULATED}"
    age, delay = snapshot.stamp - cloud.stamp[k], snapshot.delay[k : k + 1]
    across, down = kind.field_of_view_deg
    near = "-" if not len(seen) else f"{100 * seen.min():.1f} / {100 * np.median(seen):.1f} cm"
    return [
        ("state", escape(state if done == WELL else f"{state} ({done}, by a person)")),
        ("type", escape(f"{kind.title}{where}")),
        ("distance, nearest / median", near),
        ("zones", ", ".join(
            f"{counts[v]} {v.name.lower().replace('_', ' ')}" for v in Verdict if counts[v]
        )),
        ("zones of no use", f"{100.0 * BAD[verdict].mean():.0f} %"),
        ("age of the frame", f"{1000.0 * age:.0f} ms" if np.isfinite(age) else "-"),
        ("frames a second", f"{snapshot.rate[k]:.1f} of {kind.rate_hz:g}"),
        ("measured to used", f"{1000.0 * delay[0]:.0f} ms" if np.isfinite(delay).any() else "-"),
        ("place known to",
         f"{1000.0 * doubt.position[k]:.1f} mm, {np.degrees(doubt.angle[k]):.2f} deg"),
        ("field of view", f"{across:g} x {down:g} deg, {kind.rows} x {kind.columns} zones"),
        ("range", f"{100.0 * kind.least_m:g} to {100.0 * kind.most_m:g} cm"),
        ("sits on", escape(f"{sensor.link}")),
    ]  # fmt: skip
