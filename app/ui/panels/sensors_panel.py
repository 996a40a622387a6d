"""One sensor, chosen by name: what it is, what its zones see, and in a mixed skin where its frames
come from."""

from typing import Any

import viser

from app.actions import UseSensor
from app.messages import SensorHealth, Snapshot, Verdict
from app.robot.skin import Skin
from app.ui.colours import POINT, css
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.panels.assign import assign

REAL, SIMULATED = "real", "simulated"
PERIOD = 0.25  # [s]
WIDTH = 300  # pixels of the picture of the zones
NOTHING = "#e4e6e9"  # of a zone that has no distance


class SensorsPanel:
    """A sensor, a picture of its zones if asked for, and two buttons in a mixed skin."""

    def __init__(self, server: viser.ViserServer, engine: Engine, recorded: bool = False) -> None:
        """recorded: where its frames came from cannot be changed any more."""
        gui = server.gui
        self._recorded = recorded
        self._skin = engine.skin
        self._names = tuple(s.name for s in engine.skin.sensors)
        self._pace = Every(PERIOD)
        with gui.add_folder("Sensors"):
            self.choice = gui.add_dropdown("Sensor", self._names, hint="the one to look at")
            self.kind = gui.add_text("Type", "", disabled=True)
            self.look = gui.add_checkbox(
                "Zones", False, hint="what each of its zones sees, as it looks out"
            )
            self.zones = gui.add_html("", visible=False)
        self.folder = gui.add_folder("Real and simulated sensors", visible=False)
        with self.folder:
            self.state = gui.add_text("Feeds from", "", disabled=True)
            self.switch = gui.add_button_group("Feed it from", (REAL, SIMULATED))

        @self.switch.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            engine.post(UseSensor(self.choice.value, event.target.value == REAL))

    def update(self, snapshot: Snapshot) -> None:
        if not self._pace.due(snapshot.stamp):
            return
        k = self._names.index(self.choice.value)
        assign(self.kind, self._skin.sensors[k].type.title)
        if self.zones.visible != self.look.value:
            self.zones.visible = self.look.value
        if self.look.value:
            self.zones.content = zone_picture(snapshot, self._skin, k)
        mixed = snapshot.real is not None and not self._recorded
        if self.folder.visible != mixed:
            self.folder.visible = mixed
        if snapshot.real is None or self._recorded:
            return
        origin = REAL if snapshot.real[k] else SIMULATED
        health = SensorHealth(int(snapshot.health[k])).name.lower()
        words = f"{origin}, {health} ({int(snapshot.real.sum())} of {len(self._names)} real)"
        assign(self.state, words)


def zone_picture(snapshot: Snapshot, skin: Skin, k: int) -> str:
    """The zones of sensor k in rows and columns, coloured by verdict as the points are."""
    rows, columns = skin.sensors[k].type.grid
    colour = {int(v): css(c) for v, c in POINT.items()}
    cells = "".join(
        f'<i style="background:{colour.get(v, NOTHING)}" title="{Verdict(v).name.lower()}"></i>'
        for v in snapshot.cloud.verdict[skin.zones(k)].tolist()
    )
    return (
        f'<style>.zones i{{aspect-ratio:1}}</style><div class="zones" data-zones="{rows}x{columns}"'
        f' style="display:grid;gap:1px;margin:0 4% 0.7em;max-width:{WIDTH}px;'
        f'grid-template-columns:repeat({columns},1fr)">{cells}</div>'
    )
