"""`flinch replay`: a recorded run on the page, in figures, or verified."""

import os
import signal
import sys
import threading
import webbrowser
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyro

from app.cli.desktop import has_desktop
from app.errors import ConfigError, RecordingError
from app.timing import WallClock
from app.ui.entrance import Entrance, checked_origin, operator_token

if TYPE_CHECKING:  # the parts of a brain take a second to load; --help need not wait for it
    from app.record.recording import Recording

DEFAULT_PORT = 8080


@dataclass(frozen=True)
class Replay:
    """Show a recorded run on the page: play, step, scrub; or tell it in figures, or verify it."""

    file: tyro.conf.Positional[Path]
    """A recording, from `flinch run --record FILE.mcap`."""
    ghost: str = ""
    """Another controller, by its mode, that is given the same frames: what it would have told the
    arm there (an open loop: it never gets anywhere by itself)."""
    set: tuple[str, ...] = ()
    """Other settings for the ghost, NAME=VALUE each; without --ghost it is the same controller."""
    verify: bool = False
    """Compute every tick anew and compare with what was written down; exit code 1 if it differs."""
    headless: bool = False
    """No page: print a summary."""
    json: bool = False
    """Print the summary, or the verdict, as one JSON object."""
    plot: Path | None = None
    """Draw distance, command and activation over time into this file (.svg, .png)."""
    port: int = DEFAULT_PORT
    """Port of the page; 0 takes a free one."""
    host: str = "127.0.0.1"
    """Address that the page listens on; beyond this machine it takes an operator token."""
    token_file: Path | None = None
    """A file with the operator token; the variable FLINCH_TOKEN can hold it instead."""
    origin: tuple[str, ...] = ()
    """Public addresses of the page, as of a proxy in front: https://cell.example."""
    open: bool = True
    """Open the page in a browser where there is a desktop."""

    def __post_init__(self) -> None:
        if not 0 <= self.port < 65536:
            raise ConfigError(f"port = {self.port}; give a value from 0 to 65535")
        if self.json and not (self.headless or self.verify):
            raise ConfigError("--json belongs to figures; add --headless or --verify")

    def __call__(self) -> None:
        from app.plot import check_plot
        from app.record.reader import open_recording

        if self.plot is not None:
            check_plot(self.plot)
        changes = self._changes()
        with open_recording(self.file) as recording:
            if not len(recording):
                why = recording.torn or "it is empty"
                raise RecordingError(f"{self.file}: holds no tick ({why})")
            if recording.torn:
                print(f"{self.file} ends early: {recording.torn}", file=sys.stderr)
            if self.verify:
                self._verify(recording)
            elif self.headless or self.plot is not None:
                self._tell(recording, changes)
            else:
                self._serve(recording, changes)

    def _changes(self) -> dict[str, Any]:
        """The settings of the ghost; empty: there is none."""
        from app.control.registry import kind_of
        from app.replay.wanted import settings_of

        changes = settings_of(self.set)
        if self.ghost:
            changes["mode"] = kind_of(self.ghost, "ghost").name
        return changes

    def _verify(self, recording: "Recording") -> None:
        from app.replay.verify import verify

        verdict = verify(recording, told=_tell_progress)
        print(verdict.to_json() if self.json else verdict.to_text())
        if not verdict.ok:
            raise RecordingError(f"{self.file} is not what is computed now")

    def _tell(self, recording: "Recording", changes: dict[str, Any]) -> None:
        from app.replay.summary import beside_ghost, summary

        if changes:
            report = beside_ghost(recording, changes, self.plot)
        else:
            report = summary(recording, self.plot)
        print(report.to_json() if self.json else report.to_text())

    def _serve(self, recording: "Recording", changes: dict[str, Any]) -> None:
        """The page until the process is asked to end."""
        from app.replay.made import player_of
        from app.ui.replay_page import ReplayPage

        quit_asked = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: quit_asked.set())
        entrance = self._entrance()
        host, port, token, origins = entrance
        player, survey = player_of(recording, WallClock(), changes, f"recorded, {self.file.name}")
        page = ReplayPage(player, survey, host, port, token=token, origins=origins)
        try:
            player.start()
            page.start()
            print(f"{self.file.name} is at {page.url}  (Ctrl-C ends it)", flush=True)
            for line in entrance.words():
                print(line, flush=True)
            if self.open and has_desktop():
                webbrowser.open(page.url)
            quit_asked.wait()
        finally:
            page.stop()
            player.stop()

    def _entrance(self) -> Entrance:
        origins = tuple(map(checked_origin, self.origin))
        token = operator_token(self.host, origins, self.token_file, os.environ)
        return Entrance(self.host, self.port, token, origins)


def _tell_progress(done: int, of: int) -> None:
    """One line that is written over, at a terminal only."""
    if sys.stderr.isatty():
        end = "\n" if done == of else ""
        print(f"\r\033[Ktick {done} of {of}", end=end, flush=True, file=sys.stderr)
