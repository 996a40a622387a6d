"""Run, Hold, Stop and what the arm does, in a place of their own: the page's bar.

A panel beside the main one, so it neither scrolls nor goes with a tab. The buttons come first and
each line of text below has a fixed room, so that nothing here ever moves; what does not fit is
read by resting the mouse on it. No handle drags it away or folds it up: Stop may not be lost.
"""

from html import escape
from typing import Any

import viser

from app.actions import SetMode
from app.messages import NO_NOTICE, Mode, Notice, Snapshot
from app.timing import Clock
from app.ui.access import words
from app.ui.colours import ALARM, CALM, DANGER, FIXED, GO, GREY, RGB, WAIT, WARN, css
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.reading import Reading
from app.ui.words import MOVING, doing_words, fixed_words, state_words, too_near, yielding_words

COLOUR = {Mode.IDLE: GREY, Mode.RUNNING: CALM, Mode.HOLDING: WAIT, Mode.STOPPED: ALARM}
NOTICE = 6.0  # [s] that a notice is shown
TOLD = 12.0  # [s] that a stop is told in a corner of every page
PERIOD = 0.1  # [s]
TINT = 62  # [%] of a state's colour in its word, which must be read easily
BEAT = 0.5  # [s] between two signs of life; the page's own script waits for them
ROOM = 206  # [px] height of the panel
PHONE = 168  # [px] its height on a phone, where Stop is at the lower edge and the hint is left out

WISH = "Keys R, H, S or space · Stop travels over a network: it is not an emergency stop"


class ArmPanel:
    """Three buttons with their keys; the state, what is near and what is done about it, and why.

    Of what is near it tells two distances: of what can give way, which is promised to be kept, and
    of what cannot.
    """

    def __init__(
        self, server: viser.ViserServer, engine: Engine, clock: Clock, reading: Reading
    ) -> None:
        self._server, self._clock, self._reading = server, clock, reading
        self._pace, self._anew, self._mode = Every(PERIOD), -1, Mode.IDLE
        self._beats, self._beat = Every(BEAT), 0
        self._notice, self._told_at = NO_NOTICE, float("-inf")
        gui = server.gui
        panel = gui.add_panel()
        with panel.add_tab("Arm"):
            gui.add_html(panel_style(ROOM))
            self.beat = gui.add_html(beat_html(0))
            run = gui.add_button(
                "Run", color=GO, icon=viser.Icon.PLAYER_PLAY, hint="go to the goal (key R)"
            )
            hold = gui.add_button(
                "Hold", color=WAIT, icon=viser.Icon.HAND_STOP, hint="stay, but give way (key H)"
            )
            stop = gui.add_button(
                "Stop", color=DANGER, icon=viser.Icon.PLAYER_STOP,
                hint="brake, stand still (key S or space)",
            )  # fmt: skip
            self.state = gui.add_html(state_html("Waiting", GREY))
            self.does = gui.add_html(does_html(""))
            self.closest = gui.add_html(closest_html(GREY, ""))
            self.fixed = gui.add_html(fixed_html(""))
            self.why = gui.add_html(why_html("no snapshot has come yet"))
            self.notice = gui.add_html(notice_html(NO_NOTICE))
            gui.add_html(line_html(WISH, WISH, "font-size:0.72em;opacity:0.7"))
        panel.dock_above(gui.main_panel)
        panel.expand()  # on a telephone it would begin closed

        run_key = gui.add_command("Run the arm", hotkey="R")
        hold_key = gui.add_command("Hold the arm", hotkey="H")
        stop_key = gui.add_command("Stop the arm", hotkey="S")
        space = gui.add_command("Stop the arm at once", hotkey="space")
        self.buttons = (run, hold, stop)
        self.everybody = (stop, stop_key, space)  # what a page may use that only watches
        for button, keys, mode in (
            (run, (run_key,), Mode.RUNNING),
            (hold, (hold_key,), Mode.HOLDING),
            (stop, (stop_key, space), Mode.STOPPED),
        ):

            async def ask(event: Any, mode: Mode = mode) -> None:
                who = words(event.client_id)  # any page may stop the arm: people want to know
                engine.post(SetMode(mode, reason=f"asked for by a person at {who}"))

            button.on_click(ask)
            for key in keys:
                key.on_trigger(ask)

    def update(self, snapshot: Snapshot) -> None:
        mode, before = snapshot.status.mode, self._mode
        self._mode = mode
        if mode is Mode.STOPPED and before is not Mode.STOPPED:
            self._tell_stop(snapshot.status.reason)
        if self._beats.due(snapshot.stamp):
            self._beat += 1
            self.beat.content = beat_html(self._beat)
        if not self._pace.due(snapshot.stamp):
            return
        word, why = state_words(snapshot)
        self.why.content = why_html(why)
        self.notice.content = notice_html(self._recent(snapshot.notice), self._reading.pace)
        if self._reading.anew != self._anew:  # what hops is read at one pace, see there
            self._anew = self._reading.anew
            self._tell_distances(snapshot)
        close = too_near(self._reading.yields, self._reading.kept) and mode in MOVING
        self.state.content = state_html(word, WARN if close else COLOUR[mode])

    def _tell_distances(self, snapshot: Snapshot) -> None:
        read = self._reading
        self.does.content = does_html(doing_words(snapshot, read.links))
        told = yielding_words(read.yields, read.links, read.kept)
        self.closest.content = closest_html(read.colour, told)
        self.fixed.content = fixed_html(fixed_words(read.stays, read.links, read.reasons))

    def _tell_stop(self, reason: str) -> None:
        """In a corner of every page, whatever it shows."""
        for client in self._server.get_clients().values():
            client.add_notification(
                "The arm is stopped", reason, color="red", auto_close_seconds=TOLD
            )

    def silent(self, seconds: float) -> None:
        """No snapshot has come for so long; what the page shows is old."""
        self.state.content = state_html("No news", ALARM)
        self.why.content = why_html(
            f"the engine has not spoken for {seconds:.0f} s; what you see is old"
        )

    def _recent(self, notice: Notice) -> Notice:
        """The notice, for a while after it came; the same words said again are news again."""
        now = self._clock.now()
        if notice is not self._notice:
            self._notice, self._told_at = notice, now
        return notice if now - self._told_at < NOTICE else NO_NOTICE


def panel_style(room: int) -> str:
    """What lays the panel out in a height of `room` [px]."""
    # viser lays its controls out one below another, lets panels share a column by weights and puts
    # handles around each; what is marked here stands side by side in a room that stays as it is;
    # the tabs below are narrower than viser has them, so that all stand in one row; and after the
    # window was resized viser would let the column slide in anew at the next click
    return f"""<style>
div:has(> div > .arm-panel) {{ display: grid; gap: 0.15em 0.4em;
  grid-template-columns: repeat(3, minmax(0, 5.6em)) minmax(6.8em, 1fr);
  padding: 0.65em 0.7em 0 }}
div:has(> div > .arm-panel) > div {{ margin: 0 !important; padding: 0 !important; min-width: 0 }}
div:has(> div > .arm-panel) button {{ padding: 0; height: 2.3em !important }}
div:has(> .arm-panel) {{ display: none }}
div:has(> .arm-line) {{ grid-column: 1 / -1 }}
.arm-line {{ height: 1.5em; line-height: 1.5em; white-space: nowrap; overflow: hidden;
  text-overflow: ellipsis; font-variant-numeric: tabular-nums; font-size: 0.85em }}
[data-dock-scroll] > div:has(.arm-panel) {{ flex: 0 0 {room}px !important }}
[data-dock-scroll] > div:has(.arm-panel) + [data-dock-divider] {{ pointer-events: none }}
[data-dock-scroll] > div:has(.arm-panel) ~ div:not([data-dock-divider]) {{
  flex-grow: 1 !important }}
[data-dock-region]:has(.arm-panel) div:has(.arm-panel) {{ transform: none !important }}
[data-dock-region]:has(.arm-panel) [data-dock-region-handle],
[data-dock-column]:has(.arm-panel) > [data-dock-column-handle],
[data-dock-group]:has(.arm-panel) > :not(:last-child) {{ display: none !important }}
[role="tab"] {{ padding-left: 0.5em !important; padding-right: 0.5em !important }}
@media (max-width: 36em) {{
  div:has(> div > .arm-panel) {{ position: fixed; inset: 0 0 auto; height: {room}px; z-index: 20;
    background: var(--mantine-color-body) }}
  .mantine-Notifications-root {{ margin-top: {room}px }}
  .mantine-Tabs-root:has(.arm-panel) > :not(:last-child) {{ display: none !important }}
  div:has(> div > [data-beat]) {{ height: {PHONE}px !important; align-content: start;
    grid-template-columns: 5.6em 5.6em 1fr }}
  div:has(> div > [data-beat]) > :last-child {{ display: none }}
  div:has(> div > [data-beat]) > :nth-child(5) {{ position: fixed; inset: auto 0 0; z-index: 21;
    padding: 4px !important; background: var(--mantine-color-body) }}
  div:has(> div > [data-beat]) > :nth-child(5) button {{ height: 50px !important;
    font-size: 1.2em }}
}}
</style><span class="arm-panel"></span>"""


def state_html(word: str, colour: RGB) -> str:
    """The state's word beside a band of its colour."""
    return (  # the word is darker than the band: amber on white is hard to read
        f'<div data-arm="{escape(word)}" style="padding-left:0.5em;border-left:0.45em solid '
        f"{css(colour)};color:color-mix(in srgb, {css(colour)} {TINT}%, var(--mantine-color-text));"
        "height:1.9em;line-height:1.9em;font-size:1.1em;font-weight:700;"
        f'white-space:nowrap;overflow:hidden">{escape(word)}</div>'
    )


def beat_html(count: int) -> str:
    """A sign of life for `static_assets/page/watch.js`; nothing to see."""
    return f'<span class="arm-panel" data-beat="{count}"></span>'


def does_html(text: str) -> str:
    """What the controller does, in one line."""
    return line_html(escape(text), text, "font-size:0.95em;font-weight:600")


def why_html(why: str) -> str:
    """Why it is so, in the room of two lines; the mouse resting on it tells the rest."""
    why = escape(why, quote=True)
    return (
        f'<div class="arm-line" title="{why}" style="height:2.8em;line-height:1.4;'
        "white-space:normal;display:-webkit-box;-webkit-box-orient:vertical;"
        f'-webkit-line-clamp:2;overflow:hidden">{why}</div>'
    )


def closest_html(colour: RGB, text: str) -> str:
    """One line with a dot in the colour of the arrow in the scene."""
    dot = f"{dot_html(colour)} " if text else ""
    return line_html(dot + escape(text), text, "")


def fixed_html(text: str) -> str:
    """One line with a hollow dot, in grey: nothing is promised of it."""
    dot = f'<span style="color:{css(FIXED)}">&#9675;</span> ' if text else ""
    return line_html(dot + escape(text), text, "opacity:0.8")


def notice_html(notice: Notice, pace: str = "") -> str:
    """One line, empty when there is nothing to tell; a notice goes before what is too slow."""
    if not notice.words and pace:
        return line_html(f"{dot_html(WARN)} {escape(pace)}", pace, "font-weight:600")
    text = f"Refused: {notice.words}" if notice.refused else notice.words
    return line_html(escape(text), text, f"color:{css(DANGER)}" if notice.refused else "")


def dot_html(colour: RGB) -> str:
    """A dot of that colour."""
    return f'<span style="color:{css(colour)}">&#9679;</span>'


def line_html(shown: str, told: str, style: str) -> str:
    """One line that ends where the panel does; the mouse resting on it tells the rest."""
    return f'<div class="arm-line" title="{escape(told, quote=True)}" style="{style}">{shown}</div>'
