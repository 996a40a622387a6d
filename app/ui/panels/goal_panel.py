"""Goals without a mouse: a typed pose, and waypoint programs to start and end."""

from html import escape
from typing import Any

import numpy as np
import viser

from app.actions import RunProgram, SetPose
from app.messages import Snapshot
from app.ui.engine import Engine
from app.ui.pacing import Every

NONE = "(none)"


class GoalPanel:
    """Six numbers with a button, and a list of programs with two."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        gui = server.gui
        self._engine, self._pace = engine, Every(0.2)
        self.position = gui.add_vector3(
            "Tool [mm]", (500.0, 170.0, 500.0), step=10.0, hint="x, y, z from the base"
        )
        self.rpy = gui.add_vector3(
            "Turn [deg]", (-90.0, 0.0, -90.0), step=5.0,
            hint="roll, pitch, yaw about the base's x, y, z",
        )  # fmt: skip
        self.go = gui.add_button("Go there", icon=viser.Icon.TARGET)
        names = engine.programs or (NONE,)
        self.program = gui.add_dropdown("Program", names, hint="waypoints, one after another")
        self.buttons = gui.add_button_group("", ("Start", "End"))
        self.state = gui.add_html("")

        @self.go.on_click
        async def _(_: Any) -> None:
            x, y, z = (v / 1000.0 for v in self.position.value)
            roll, pitch, yaw = (float(v) for v in np.radians(self.rpy.value))
            engine.post(SetPose((x, y, z), (roll, pitch, yaw)))

        @self.buttons.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            start = event.target.value == "Start" and self.program.value != NONE
            engine.post(RunProgram(self.program.value if start else ""))

    def update(self, snapshot: Snapshot) -> None:
        if self._pace.due(snapshot.stamp):
            words = escape(snapshot.program) or "no program runs"
            self.state.content = f'<div style="font-size:0.85em;padding:0 0.8em">{words}</div>'
