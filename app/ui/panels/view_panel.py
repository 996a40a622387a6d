"""Switches of what the scene shows; they change the picture only, never the arm."""

from collections.abc import Iterable

import viser

from app.ui.scene.switch import Switch


class ViewPanel:
    """One box a switch."""

    def __init__(self, server: viser.ViserServer, switches: Iterable[Switch]) -> None:
        self.boxes: dict[str, viser.GuiCheckboxHandle] = {}
        for switch in switches:
            box = server.gui.add_checkbox(switch.label, switch.on, hint=switch.help or None)
            self.boxes[switch.label] = box

            @box.on_update
            async def _(
                event: viser.GuiEvent[viser.GuiCheckboxHandle], switch: Switch = switch
            ) -> None:
                switch.set(event.target.value)
