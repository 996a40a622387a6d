"""Record and stop, how the recording stands, and the last half minute of a stop.

Both need the lease, as everything else but Stop. No name or path comes from a page.
"""

from html import escape
from pathlib import Path
from typing import Any

import viser

from app.messages import Mode, Snapshot, Status
from app.record.recorder import Progress
from app.ui.colours import ALARM, GREY, RGB, css
from app.ui.desk import Desk, Kept
from app.ui.pacing import Every

PERIOD = 0.25  # [s]
IDLE = Status(Mode.IDLE, "", 0.0)
BY_HAND = "asked for by a person"  # how the reason of a stop begins that somebody wanted
TEXT = "font-size:0.85em;padding:0 0.8em 0.3em;overflow-wrap:anywhere;line-height:1.4"


class RecordPanel:
    """A text with the buttons that make sense now."""

    def __init__(self, server: viser.ViserServer, desk: Desk) -> None:
        self._desk, self._pace = desk, Every(PERIOD)
        self._status, self._now = IDLE, 0.0
        gui = server.gui
        with gui.add_folder("Record"):
            self.state = gui.add_html("")
            self.begin = gui.add_button(
                "Record", icon=viser.Icon.PLAYER_RECORD, color="red",
                hint="all that enters every tick, to be replayed, compared and exported",
            )  # fmt: skip
            self.end = gui.add_button(
                "End the recording", icon=viser.Icon.PLAYER_STOP, color="gray", visible=False
            )
        with gui.add_folder("What has just happened"):
            self.last = gui.add_html("")
            self.save = gui.add_button(
                "Save the last 30 s", icon=viser.Icon.DEVICE_FLOPPY, color="gray"
            )
        self.outcome = gui.add_html("")

        # these wait for the disk: not on the thread of the sockets
        @self.begin.on_click
        def _(_: Any) -> None:
            desk.begin()

        @self.end.on_click
        def _(_: Any) -> None:
            desk.end()

        @self.save.on_click
        def _(_: Any) -> None:
            desk.save_last(stop_reason(self._status))

        self._show()

    def update(self, snapshot: Snapshot) -> None:
        if self._pace.due(snapshot.stamp):
            self._status, self._now = snapshot.status, snapshot.stamp
            self._show()

    def _show(self) -> None:
        progress = self._desk.progress
        runs = progress is not None and not progress.fault
        self.state.content = state_html(progress, self._desk.folder)
        self.begin.visible, self.end.visible = not runs, runs
        fault, held = stop_reason(self._status), self._desk.held
        self.last.content = last_html(fault, self._now - self._status.since, held)
        self.save.disabled = held <= 0.0
        self.save.color = "red" if fault and self._now - self._status.since < held else "gray"
        self.outcome.content = outcome_html(self._desk.kept, self._desk.fault)


def stop_reason(status: Status) -> str:
    """Why the arm was stopped, if nobody wanted it; else empty."""
    stopped = status.mode is Mode.STOPPED and not status.reason.startswith(BY_HAND)
    return f"stopped: {status.reason}" if stopped else ""


def state_html(progress: Progress | None, folder: Path) -> str:
    """Whether it records, how much there is, and why it has ended if nobody ended it."""
    if progress is None:
        where = escape(str(folder))
        return text_html(
            f"Nothing is recorded. Files go to <b>{where}/</b> where Flinch runs.", GREY
        )
    size = f"{progress.seconds:.0f} s, {progress.bytes / 1e6:.1f} MB"
    lost = f"{progress.dropped} ticks dropped" if progress.dropped else "nothing dropped"
    if progress.fault:
        return text_html(f"<b>Ended by itself:</b> {escape(progress.fault)} ({size} kept)", ALARM)
    name = escape(progress.path.name)
    return text_html(f"<b>Recording</b> {size}, {lost}<br>{name}", ALARM, "&#9679;")


def last_html(fault: str, ago: float, held: float) -> str:
    """What the button would keep."""
    if fault and ago < held:
        return text_html(
            f"The arm has <b>{escape(fault)}</b>, {ago:.0f} s ago: save it now.", ALARM
        )
    if fault:
        return text_html(f"The last {held:.0f} s are at hand; the stop is older than that.", GREY)
    return text_html(f"The last {held:.0f} s are at hand.", GREY)


def outcome_html(kept: Kept | None, fault: str) -> str:
    """What became of the last wish, and how to see it again."""
    if fault:
        return text_html(f"Not done: {escape(fault)}", ALARM)
    if kept is None:
        return ""
    path = escape(str(kept.path))
    return text_html(
        f"Kept {kept.seconds:.0f} s. See it again, or mail it:<br>"
        f"<code>flinch replay {path}</code><br><code>flinch export {path} OUT.html</code>",
        GREY,
    )


def text_html(content: str, colour: RGB, mark: str = "") -> str:
    """Lines of text, with a mark in the colour before them."""
    dot = f'<span style="color:{css(colour)}">{mark}</span> ' if mark else ""
    shade = f";color:{css(colour)}" if colour is ALARM and not mark else ""
    return f'<div style="{TEXT}{shade}">{dot}{content}</div>'
