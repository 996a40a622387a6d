"""Switches of what the scene shows; they change the picture only, never the arm."""

from collections.abc import Iterable

import viser

from app.ui.scene.switch import Switch


class ViewPanel:
    """One box a switch that the legend has not; those with a sign are there."""

    def __init__(self, server: viser.ViserServer, switches: Iterable[Switch]) -> None:
        self.boxes = {s.label: add_box(server, s) for s in switches}


def add_box(server: viser.ViserServer, switch: Switch) -> viser.GuiCheckboxHandle:
    """A box for the switch, where the next control would be."""
    box = server.gui.add_checkbox(switch.label, switch.on, hint=switch.help or None)

    @box.on_update
    async def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
        switch.set(event.target.value)

    return box
