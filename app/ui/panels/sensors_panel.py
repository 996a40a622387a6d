"""Which sensors of a mixed skin are real: one is chosen by name and switched."""

from typing import Any

import viser

from app.actions import UseSensor
from app.messages import SensorHealth, Snapshot
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.panels.assign import assign

REAL, SIMULATED = "real", "simulated"
PERIOD = 0.25  # [s]


class SensorsPanel:
    """A sensor, where its frames come from, and two buttons; hidden unless the skin is mixed."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        gui = server.gui
        self._names = tuple(s.name for s in engine.skin.sensors)
        self._pace = Every(PERIOD)
        self.folder = gui.add_folder("Real and simulated sensors", visible=False)
        with self.folder:
            self.choice = gui.add_dropdown("Sensor", self._names, hint="the one to switch")
            self.state = gui.add_text("Feeds from", "", disabled=True)
            self.switch = gui.add_button_group("Feed it from", (REAL, SIMULATED))

        @self.switch.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            engine.post(UseSensor(self.choice.value, event.target.value == REAL))

    def update(self, snapshot: Snapshot) -> None:
        if not self._pace.due(snapshot.stamp):
            return
        mixed = snapshot.real is not None
        if self.folder.visible != mixed:
            self.folder.visible = mixed
        if snapshot.real is None:
            return
        k = self._names.index(self.choice.value)
        origin = REAL if snapshot.real[k] else SIMULATED
        health = SensorHealth(int(snapshot.health[k])).name.lower()
        words = f"{origin}, {health} ({int(snapshot.real.sum())} of {len(self._names)} real)"
        assign(self.state, words)
