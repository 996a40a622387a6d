"""The learned background: asked for, counted down, shown, kept or discarded, forgotten.

    idle ─► ask to learn ─► learning ─► preview ─► idle
      └───► ask to forget ───────────────────────────┘

Who stands still in the cell meanwhile is learned as well, and is then avoided as a wall is, no
more: so nothing is known before a person has looked at it. Under a button that asks comes the
one that goes back, so that pressing twice does no harm.
"""

from collections.abc import Callable, Coroutine
from enum import Enum
from typing import Any

import numpy as np
import viser

from app.actions import DiscardBackground, ForgetBackground, KeepBackground, LearnBackground
from app.messages import BackgroundView, Snapshot
from app.ui.colours import CALM, DANGER, css
from app.ui.engine import Engine
from app.ui.pacing import Every

PERIOD = 0.1  # [s]
SECONDS = LearnBackground().seconds
NOTHING = BackgroundView(np.empty((0, 3)), np.empty((0, 3)))
Pressed = Callable[[Any], Coroutine[Any, Any, None]]


class Stage(Enum):
    """What the panel is about."""

    IDLE = "idle"
    ASK_LEARN = "ask to learn"
    LEARNING = "learning"
    PREVIEW = "preview"
    ASK_FORGET = "ask to forget"


class BackgroundPanel:
    """A text, with a bar while it learns, and the two buttons that make sense now."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        self._pace = Every(PERIOD)
        self._asked, self._view = Stage.IDLE, NOTHING
        self._buttons: list[tuple[viser.GuiButtonHandle, Stage]] = []
        self._folder = server.gui.add_folder("Learned background")
        with self._folder:
            self.text = server.gui.add_html("")
        gui = server.gui
        self.learn = self._button(gui, Stage.IDLE, "Learn background", viser.Icon.PHOTO)
        self.forget = self._button(gui, Stage.IDLE, "Forget background", viser.Icon.TRASH)
        self.cancel = self._button(gui, Stage.ASK_LEARN, "Cancel")
        self.begin = self._button(gui, Stage.ASK_LEARN, "Begin", viser.Icon.PLAYER_PLAY, "blue")
        self.abort = self._button(gui, Stage.LEARNING, "Stop learning")
        self.discard = self._button(gui, Stage.PREVIEW, "Discard", viser.Icon.TRASH)
        self.keep = self._button(gui, Stage.PREVIEW, "Keep", viser.Icon.CHECK, "blue")
        self.forget_all = self._button(gui, Stage.ASK_FORGET, "Forget all of it", None, DANGER)
        self.spare = self._button(gui, Stage.ASK_FORGET, "Cancel")

        @self.begin.on_click
        async def _(_: Any) -> None:
            engine.post(LearnBackground(SECONDS))

        @self.abort.on_click
        @self.discard.on_click
        async def _(_: Any) -> None:
            engine.post(DiscardBackground())

        @self.keep.on_click
        async def _(_: Any) -> None:
            engine.post(KeepBackground())

        @self.forget_all.on_click
        async def _(_: Any) -> None:
            engine.post(ForgetBackground())

        self.learn.on_click(self._asks(Stage.ASK_LEARN))
        self.forget.on_click(self._asks(Stage.ASK_FORGET))
        for button in (self.cancel, self.begin, self.forget_all, self.spare):
            button.on_click(self._asks(Stage.IDLE))
        self._show()

    def update(self, snapshot: Snapshot) -> None:
        if self._pace.due(snapshot.stamp):
            self._view = snapshot.background
            self._show()

    @property
    def stage(self) -> Stage:
        """What there is wins over what was asked."""
        if self._view.left > 0.0:
            return Stage.LEARNING
        return Stage.PREVIEW if len(self._view.preview) else self._asked

    def _button(
        self, gui: viser.GuiApi, stage: Stage, label: str, icon: Any = None, color: Any = "gray"
    ) -> viser.GuiButtonHandle:
        with self._folder:
            button = gui.add_button(label, icon=icon, color=color, visible=False)
        self._buttons.append((button, stage))
        return button

    def _asks(self, stage: Stage) -> Pressed:
        async def pressed(_: Any) -> None:
            self._asked = stage
            self._show()

        return pressed

    def _show(self) -> None:
        stage, view = self.stage, self._view
        done = 1.0 - view.left / SECONDS if stage is Stage.LEARNING else 0.0
        self.text.content = text_html(background_words(stage, view), done)
        self.forget.disabled = not len(view.known)
        for button, its in self._buttons:
            button.visible = its is stage


def background_words(stage: Stage, view: BackgroundView) -> str:
    """What is known, or what is asked."""
    known, found = len(view.known), len(view.preview)
    match stage:
        case Stage.ASK_LEARN:
            return (
                f"What stands still for the next {SECONDS:.0f} s counts as known, and the arm "
                "is no more careful of it than of a wall. People must be out of the cell."
            )
        case Stage.LEARNING:
            return f"Learning, {view.left:.1f} s to go. Stay out of the cell and move nothing."
        case Stage.PREVIEW:
            return f"{found} cells found, drawn in the scene. Discard them if any is of a person."
        case Stage.ASK_FORGET:
            return f"Forget all {known} known cells? What is there is then an obstacle again."
    if known:
        return f"{known} cells are known: they stand still and bound the motion."
    return "Nothing is learned. What always stands here need not count as an obstacle."


def text_html(text: str, done: float) -> str:
    """A paragraph in the room of three lines, and a bar that is full when `done` is 1."""
    return (
        '<div style="font-size:0.85em;line-height:1.4;min-height:4.4em;padding:0 0.8em">'
        f"{text}</div>"
        f'<div style="height:0.25em;margin:0 0.7em 0.5em;width:{94.0 * max(done, 0.0):.0f}%;'
        f'background:{css(CALM)}"></div>'
    )
