"""Who is in the simulated world, and whether it stands still. Not offered before real sensors."""

from typing import Any

import viser

from app.actions import PauseWorld, Remark, SetPerson, StepWorld
from app.errors import FlinchError
from app.messages import Snapshot
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.shelf import Shelf
from app.ui.undo import Undo
from app.world.people import WHO
from app.world.saving import scene_text
from app.world.scene import find_scene

PERIOD = 0.25  # [s]
STEP = 0.2  # [s] of a press


class WorldPanel:
    """Person, pause, step, undo and redo."""

    def __init__(
        self, server: viser.ViserServer, engine: Engine, undo: Undo, shelf: Shelf | None = None,
        scene: str = "",
    ) -> None:  # fmt: skip
        """shelf: where scenes are saved, None: nowhere.   scene: name or path of the one here."""
        gui = server.gui
        self._gui, self._engine, self._shelf, self._scene = gui, engine, shelf, scene
        self._undo, self._pace = undo, Every(PERIOD)
        self.back = gui.add_button_group(
            "Goal, bodies", ("undo", "redo"), hint="Ctrl+Z and Ctrl+Shift+Z as well"
        )
        self.person = gui.add_button_group(
            "Person", tuple(WHO), visible=engine.editable,
            hint="nobody; one who walks past the arm; one who works beside it",
        )  # fmt: skip
        self.pause = gui.add_checkbox(
            "Pause people", False, visible=engine.editable,
            hint="whoever follows a script stands still; the arm goes on",
        )  # fmt: skip
        self.step = gui.add_button(
            f"Step {STEP:g} s", color="gray", icon=viser.Icon.PLAYER_TRACK_NEXT, disabled=True,
            visible=engine.editable,
        )  # fmt: skip
        self.save = gui.add_button(
            "Save this scene", color="gray", icon=viser.Icon.DEVICE_FLOPPY,
            visible=engine.editable and shelf is not None,
            hint="with the bodies that were added here: a file for flinch run --scene FILE",
        )  # fmt: skip

        self._listen()

    def _listen(self) -> None:
        undo, engine, gui = self._undo, self._engine, self._gui

        # this waits for the disk: not on the thread of the sockets
        @self.save.on_click
        def _(_: Any) -> None:
            self.keep()

        undo_key = gui.add_command("Undo", hotkey="Z", modifier="cmd/ctrl")
        redo_key = gui.add_command("Redo", hotkey="Z", modifier="cmd/ctrl+shift")

        async def undone(_: Any) -> None:
            undo.undo()

        async def redone(_: Any) -> None:
            undo.redo()

        undo_key.on_trigger(undone)
        redo_key.on_trigger(redone)

        @self.back.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            undo.undo() if event.target.value == "undo" else undo.redo()

        @self.person.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            engine.post(SetPerson(event.target.value))

        @self.pause.on_update
        async def _(event: viser.GuiEvent[Any]) -> None:
            engine.post(PauseWorld(event.target.value))
            self.step.disabled = not event.target.value

        @self.step.on_click
        async def _(_: viser.GuiEvent[Any]) -> None:
            engine.post(StepWorld(STEP))

    def keep(self) -> None:
        """Save the scene and say where, or why not."""
        if self._shelf is None:
            return
        try:
            path = self._shelf.save(scene_text(find_scene(self._scene), self._undo.added()))
            self._engine.post(Remark(f"scene saved: flinch run --scene {path}"))
        except FlinchError as error:
            self._engine.post(Remark(str(error), refused=True))

    def update(self, snapshot: Snapshot) -> None:
        self._undo.see(snapshot)
