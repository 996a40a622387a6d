"""Run, hold, stop; what the arm does and why."""

from html import escape
from typing import Any, get_args

import viser

from app.actions import LearnBackground, SetMode, SetParams
from app.config import ControlMode
from app.messages import Mode, Snapshot
from app.timing import Clock
from app.ui.access import words
from app.ui.colours import ALARM, CALM, GREY, WARN, css
from app.ui.engine import Engine
from app.ui.pacing import Every, HandsOff
from app.ui.panels.assign import assign
from app.ui.words import link_words

WORDS = {
    Mode.IDLE: ("Idle", GREY, "stands still"),
    Mode.RUNNING: ("Running", CALM, "goes to the goal and gives way"),
    Mode.HOLDING: ("Holding", WARN, "stays where it is and gives way"),
    Mode.STOPPED: ("Stopped", ALARM, "stands still"),
}
CONTROL: dict[ControlMode, str] = {
    "qp": "Whole body, bounds (QP)",
    "wb": "Whole body, closest (WB)",
    "sm": "Sensor mounts (SM)",
    "multi": "Whole body, every link",
    "ssm": "Slow and stop only (SSM)",
}
assert set(CONTROL) == set(get_args(ControlMode))


class ControlPanel:
    """The three buttons, the controller, and the state in plain words."""

    def __init__(self, server: viser.ViserServer, engine: Engine, clock: Clock) -> None:
        gui = server.gui
        self._engine = engine
        self._hands = HandsOff(clock)
        self._pace = Every(0.1)
        self._names = [link_words(link) for link in engine.robot.links]
        self.state = gui.add_html(state_html("Waiting", GREY, "no snapshot has come yet", ""))
        run = gui.add_button(
            "Run", color="green", icon=viser.Icon.PLAYER_PLAY, hint="go to the goal (key R)"
        )
        hold = gui.add_button(
            "Hold", color="yellow", icon=viser.Icon.HAND_STOP, hint="stay, but give way (key H)"
        )
        stop = gui.add_button(
            "Stop", color="red", icon=viser.Icon.PLAYER_STOP, hint="brake, stand still (key S)"
        )
        gui.add_html(
            '<div style="font-size:0.75em;opacity:0.7;padding:0 0.8em">'
            "Stop is a wish sent over a network, not an emergency stop.</div>"
        )
        self.control = gui.add_dropdown(
            "Controller",
            tuple(CONTROL.values()),
            hint="every near pair at once, the closest point of the body, or the sensors' mounts",
        )
        learn = gui.add_button(
            "Learn background", icon=viser.Icon.PHOTO, hint="what stands still for 3 s is static"
        )

        @learn.on_click
        async def _(_: Any) -> None:
            engine.post(LearnBackground())

        run_key = gui.add_command("Run the arm", hotkey="R")
        hold_key = gui.add_command("Hold the arm", hotkey="H")
        stop_key = gui.add_command("Stop the arm", hotkey="S")
        self.everybody = (stop, stop_key)  # what a page may use that only watches
        for button, key, mode in (
            (run, run_key, Mode.RUNNING),
            (hold, hold_key, Mode.HOLDING),
            (stop, stop_key, Mode.STOPPED),
        ):

            async def ask(event: Any, mode: Mode = mode) -> None:
                who = words(event.client_id)  # any page may stop the arm: people want to know
                engine.post(SetMode(mode, reason=f"asked for by a person at {who}"))

            button.on_click(ask)
            key.on_trigger(ask)

        @self.control.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            self._choose(event)

    def update(self, snapshot: Snapshot) -> None:
        if self._hands.free:
            assign(self.control, CONTROL[snapshot.params.mode])
        if self._pace.due(snapshot.stamp):
            word, colour, meaning = WORDS[snapshot.status.mode]
            reason = snapshot.status.reason
            told = f"{meaning}: {reason}" if reason else meaning
            notice = snapshot.notice
            refused = f"Refused: {notice.words}" if notice.refused else notice.words
            below = refused or snapshot.advice or self._closest(snapshot)
            self.state.content = state_html(word, colour, told, below)

    def silent(self, seconds: float) -> None:
        """No snapshot has come for so long; what the page shows is old."""
        words = f"the engine has not spoken for {seconds:.0f} s; what you see is old"
        self.state.content = state_html("No news", ALARM, words, "")

    def _closest(self, snapshot: Snapshot) -> str:
        pairs = snapshot.pairs
        if pairs.closest < 0:
            return "Nothing in sight of the skin"
        link = self._names[int(pairs.link[pairs.closest])]
        share = 100.0 * snapshot.command.activation
        return f"Closest {100.0 * pairs.minimum:.0f} cm at the {link} · avoidance {share:.0f} %"

    def _choose(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        if event.client_id is None:  # the page itself showed another window's choice
            return
        self._hands.touch()
        chosen = next(mode for mode, label in CONTROL.items() if label == event.target.value)
        self._engine.post(SetParams({"mode": chosen}))


def state_html(word: str, colour: tuple[int, int, int], why: str, below: str) -> str:
    """A coloured band with the state, the reason under it and one more line."""
    return (
        f'<div style="margin:0.2em 0.8em;border-left:0.5em solid {css(colour)};'
        f'padding:0.1em 0.7em"><div style="font-size:1.35em;font-weight:700;'
        f'color:{css(colour)}" data-arm="{escape(word)}">{escape(word)}</div>'
        f'<div style="font-size:0.85em">{escape(why)}</div>'
        f'<div style="font-size:0.85em;opacity:0.75">{escape(below)}&nbsp;</div></div>'
    )
