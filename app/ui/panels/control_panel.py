"""Which controller avoids."""

import viser

from app.actions import SetParams
from app.control.registry import kinds
from app.messages import Snapshot
from app.timing import Clock
from app.ui.engine import Engine
from app.ui.pacing import Every, HandsOff
from app.ui.panels.assign import assign

PERIOD = 0.2  # [s]


class ControlPanel:
    """One list of controllers, by the names that people use."""

    def __init__(self, server: viser.ViserServer, engine: Engine, clock: Clock) -> None:
        self._engine, self._hands, self._pace = engine, HandsOff(clock), Every(PERIOD)
        self._label = {kind.name: kind.label for kind in kinds().values()}
        self.control = server.gui.add_dropdown(
            "Controller",
            tuple(self._label.values()),
            hint="; ".join(f"{kind.label}: {kind.help}" for kind in kinds().values()),
        )

        @self.control.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            self._choose(event)

    def update(self, snapshot: Snapshot) -> None:
        if self._hands.free and self._pace.due(snapshot.stamp):
            assign(self.control, self._label[snapshot.params.mode])

    def _choose(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        if event.client_id is None:  # the page itself showed another window's choice
            return
        self._hands.touch()
        chosen = next(mode for mode, label in self._label.items() if label == event.target.value)
        self._engine.post(SetParams({"mode": chosen}))
