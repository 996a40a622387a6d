"""Which controller avoids."""

from typing import get_args

import viser

from app.actions import SetParams
from app.config import ControlMode
from app.messages import Snapshot
from app.timing import Clock
from app.ui.engine import Engine
from app.ui.pacing import Every, HandsOff
from app.ui.panels.assign import assign

CONTROL: dict[ControlMode, str] = {
    "qp": "Whole body, bounds (QP)",
    "wb": "Whole body, closest (WB)",
    "sm": "Sensor mounts (SM)",
    "multi": "Whole body, every link",
    "ssm": "Slow and stop only (SSM)",
}
assert set(CONTROL) == set(get_args(ControlMode))
PERIOD = 0.2  # [s]


class ControlPanel:
    """One list of controllers, by the names that people use."""

    def __init__(self, server: viser.ViserServer, engine: Engine, clock: Clock) -> None:
        self._engine, self._hands, self._pace = engine, HandsOff(clock), Every(PERIOD)
        self.control = server.gui.add_dropdown(
            "Controller",
            tuple(CONTROL.values()),
            hint="every near pair at once, the closest point of the body, or the sensors' mounts",
        )

        @self.control.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            self._choose(event)

    def update(self, snapshot: Snapshot) -> None:
        if self._hands.free and self._pace.due(snapshot.stamp):
            assign(self.control, CONTROL[snapshot.params.mode])

    def _choose(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        if event.client_id is None:  # the page itself showed another window's choice
            return
        self._hands.touch()
        chosen = next(mode for mode, label in CONTROL.items() if label == event.target.value)
        self._engine.post(SetParams({"mode": chosen}))
