"""`flinch record-skin`: what a skin says over its ports, byte for byte, with times."""

import signal
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from app.cli.which import WhichRobot
from app.errors import ConfigError
from app.timing import WallClock


@dataclass(frozen=True)
class RecordSkin(WhichRobot):
    """Record a skin's raw bytes and when they came: flinch run --sensors replay:FILE."""

    port: Annotated[str, tyro.conf.Positional]
    """PORT[@BAUD][#FORMAT][=SENSORS], several separated by commas, or 'auto', as after serial: in
    flinch run --sensors."""
    file: Annotated[Path, tyro.conf.Positional]
    """A new file, whose name ends in .mcap say."""
    seconds: float = 0.0
    """How long [s]; 0: until Ctrl-C."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.seconds < 1e9:
            raise ConfigError(f"seconds = {self.seconds:g}; give a positive number, or 0 for ever")

    def __call__(self) -> None:
        from app.checks.skin_record import record_skin
        from app.choices import build_robot_and_skin

        quit_asked = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: quit_asked.set())
        clock = WallClock()
        robot, skin = build_robot_and_skin(self.setup())
        end = clock.now() + self.seconds if self.seconds else float("inf")
        size, states = record_skin(
            self.port,
            self.file,
            robot,
            skin,
            clock,
            lambda words: print(f"{words}  (Ctrl-C ends it)", flush=True),
            lambda: quit_asked.is_set() or clock.now() >= end,
        )
        for name, words in states:
            print(f"{name}: {words}")
        print(f"{size / 1e3:.1f} kB; play them by flinch run --sensors replay:{self.file}")
