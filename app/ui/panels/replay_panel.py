"""Play, pause, step and scrub, and what the arm did: where the live page has Run, Hold and Stop.

The same room and the same lines as `app.ui.panels.arm_panel`, but nothing here reaches an arm.
"""

from collections.abc import Sequence
from html import escape
from typing import Any

import viser

from app.messages import NO_NOTICE, Snapshot
from app.record.marks import Mark
from app.replay.player import Player
from app.timing import Clock
from app.ui.colours import ALARM, GREY
from app.ui.pacing import Every, HandsOff
from app.ui.panels.arm_panel import (
    COLOUR,
    closest_html,
    does_html,
    fixed_html,
    line_html,
    notice_html,
    panel_style,
    state_html,
    why_html,
)
from app.ui.panels.assign import assign
from app.ui.reading import Reading
from app.ui.words import doing_words, fixed_words, state_words, yielding_words

PERIOD = 0.1  # [s] between two looks at the words
ROOM = 266  # [px] height of the panel
MOST_MARKS = 40  # on the scrub bar; more are a smear
SPEEDS = {"0.1 x": 0.1, "0.25 x": 0.25, "0.5 x": 0.5, "1 x": 1.0, "2 x": 2.0, "4 x": 4.0}
KEYS = "Keys: P plays and pauses, B and N go a tick, J and K a mark"
BAR = """<style>
div:has(> div > .arm-panel) > div:has([role="slider"]) { grid-column: 1 / -1;
  margin-bottom: 0.7em !important }
</style><span class="arm-panel"></span>"""


class ReplayPanel:
    """Three buttons, a bar with marks, and the lines that the live page has.

    The first of the views that a snapshot is shown to: while the recording stands still, `paces`
    are told to forget, so that every view shows it, however little time has passed in it.
    """

    def __init__(
        self, server: viser.ViserServer, player: Player, clock: Clock, marks: Sequence[Mark],
        reading: Reading,
    ) -> None:  # fmt: skip
        """reading: read here, after the paces have forgotten, for all the other views."""
        self._player, self._hands, self._pace = player, HandsOff(clock), Every(PERIOD)
        self._reading = reading
        self.marks = tuple(marks)
        self._places = [player.place_of(m.tick) for m in marks]
        self.paces: list[Every] = []
        gui, length = server.gui, player.seconds(player.last)
        panel = gui.add_panel()
        with panel.add_tab("Recording"):
            gui.add_html(panel_style(ROOM))
            gui.add_html(BAR)
            self.back = gui.add_button(
                "Back", icon=viser.Icon.PLAYER_TRACK_PREV, hint="one tick back (key B)"
            )
            self.play = gui.add_button(
                "Play", color="green", icon=viser.Icon.PLAYER_PLAY, hint="play or pause (key P)"
            )
            self.on = gui.add_button(
                "Next", icon=viser.Icon.PLAYER_TRACK_NEXT, hint="one tick on (key N)"
            )
            self.state = gui.add_html(state_html("Waiting", GREY))
            self.bar = gui.add_slider(
                "Time [s]", min=0.0, max=max(length, 1e-3), step=0.001, initial_value=0.0,
                marks=bar_marks(player, self.marks) or None, hint="drag: any moment of it",
            )  # fmt: skip
            self.where = gui.add_html(line_html("", "", ""))
            self.does = gui.add_html(does_html(""))
            self.closest = gui.add_html(closest_html(GREY, ""))
            self.fixed = gui.add_html(fixed_html(""))
            self.why = gui.add_html(why_html("the first tick is being computed"))
            self.notice = gui.add_html(notice_html(NO_NOTICE))
            gui.add_html(line_html(KEYS, KEYS, "font-size:0.72em;opacity:0.7"))
        panel.dock_above(gui.main_panel)
        panel.expand()
        self._listen(server)

    def update(self, snapshot: Snapshot) -> None:
        player = self._player
        if not player.playing:
            for pace in self.paces:
                pace.anew()
        read = self._reading
        read.update(snapshot)
        if not (self._pace.due(snapshot.stamp) or not player.playing):
            return
        word, why = state_words(snapshot)
        self.state.content = state_html(word, COLOUR[snapshot.status.mode])
        self.why.content = why_html(why)
        self.does.content = does_html(doing_words(snapshot, read.links))
        told = yielding_words(read.yields, read.links, read.kept)
        self.closest.content = closest_html(read.colour, told)
        self.fixed.content = fixed_html(fixed_words(read.stays, read.links, read.reasons))
        self.notice.content = notice_html(snapshot.notice)
        if self._hands.free:
            assign(self.bar, round(snapshot.stamp - float(player.times[0]), 3))
        self.tell()

    def tell(self) -> None:
        """What the player is doing, whether or not a new tick is shown."""
        player = self._player
        playing = player.playing
        label = "Pause" if playing else "Play"
        if self.play.label != label:
            self.play.label = label
            self.play.icon = viser.Icon.PLAYER_PAUSE if playing else viser.Icon.PLAYER_PLAY
        text = where_words(player)
        html = line_html(escape(text), text, "font-size:0.85em;font-weight:600")
        if self.where.content != html:
            self.where.content = html

    def silent(self, seconds: float) -> None:
        """No other tick is shown: it stands still, or it has failed."""
        if self._player.fault:
            self.state.content = state_html("Failed", ALARM)
            self.why.content = why_html(self._player.fault)
        self.tell()

    def beside(self, count: int) -> None:
        """Go to the mark that is `count` after (or before) the tick that is shown."""
        here = self._player.at
        after = [i for i in self._places if i > here]
        before = [i for i in self._places if i < here]
        if count > 0 and after:
            self._player.seek(after[0])
        elif count < 0 and before:
            self._player.seek(before[-1])

    def _listen(self, server: viser.ViserServer) -> None:
        player, gui = self._player, server.gui
        presses = (
            (self.back, "One tick back", "B", lambda: player.step(-1)),
            (self.play, "Play or pause", "P", player.toggle),
            (self.on, "One tick on", "N", lambda: player.step(1)),
            (None, "To the mark before", "J", lambda: self.beside(-1)),
            (None, "To the next mark", "K", lambda: self.beside(1)),
        )
        for button, words, key, press in presses:

            async def pressed(_: Any, press: Any = press) -> None:
                press()

            gui.add_command(words, hotkey=key).on_trigger(pressed)  # type: ignore[arg-type]
            if button is not None:
                button.on_click(pressed)

        @self.bar.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client_id is not None:  # a hand, not the page itself
                self._hands.touch()
                player.seek_time(event.target.value)


def bar_marks(player: Player, marks: Sequence[Mark]) -> tuple[float, ...]:
    """[s] where the bar is marked: at all of them, or at the stops where there are too many."""
    chosen = marks if len(marks) <= MOST_MARKS else [m for m in marks if m.kind == "stop"]
    places = [player.place_of(m.tick) for m in chosen[:MOST_MARKS]]
    return tuple(sorted({round(player.seconds(i), 3) for i in places}))


def where_words(player: Player) -> str:
    """Time and tick that are shown, and whether another one is being computed."""
    if player.at < 0:
        return "computing the first tick"
    words = (
        f"{player.seconds(player.at):.3f} of {player.seconds(player.last):.3f} s"
        f" · tick {player.ticks[player.at]}"
    )
    wish = player.wanted
    if wish is not None and wish != player.at:
        words += f" · computing {player.seconds(wish):.1f} s"
    return words
