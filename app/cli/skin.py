"""`flinch skin`: is the skin as its layout says?"""

import signal
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from app.cli.seed import Seed
from app.cli.which import WhichRobot
from app.timing import WallClock


@dataclass(frozen=True)
class SkinCheck(WhichRobot):
    """Check a sensor against the layout: convention of its ranges, order of its zones."""

    show: Literal["wall", "hand"] = "wall"
    """A flat wall, or a hand that goes from left to right and then from top to bottom."""
    sensors: str = "simulated"
    """'simulated[@SENSOR]', PATH[@SENSOR] of a recording, or 'serial:PORT=SENSOR', with
    ':latency_ms=MS' if known."""
    seed: Seed = 0
    """Seed of the simulated noise."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.checks.skin_check import skin_check

        report = skin_check(self.setup(seed=self.seed), self.show, self.sensors)
        print(report.to_json() if self.json else report.to_text())


@dataclass(frozen=True)
class SkinEmulate(WhichRobot):
    """Speak as a skin does, over a virtual serial port: `flinch run --sensors serial:LINK`."""

    link: Path
    """Name of the port: a symbolic link that is made, and taken away at the end."""
    format: Literal["binary", "f", "table", "table-plain", "lines", "lines-plain"] = "binary"
    """What to speak; table and lines have room for one sensor. -plain: columns from the left."""
    replay: str = ""
    """Path of recorded 8x8 frames to send from every sensor, or a file of record-skin, whose bytes
    are sent once as they were; default: what the scene shows."""
    faults: str = ""
    """What goes wrong, e.g. 'bits=1e-4,drift=100': bits=SHARE, truncate=SHARE, reorder=SHARE,
    silence=FROM[:FOR] [s], drift=PPM, wrap=AFTER [s], frozen=SENSORS, columns=SENSORS,
    ids=SENSOR:SENSOR."""
    only: str = ""
    """The sensor or the ring that this port carries; default: the whole skin."""
    seconds: float = 0.0
    """How long [s]; 0: until Ctrl-C."""
    scene: str = "cell"
    """A scene's name, or the path of its TOML file: the arm stands in it at home."""
    follow: str = ""
    """'ur:HOST': be where that UR is, a virtual one too, as it moves; default: stand at home."""
    seed: Seed = 0
    """Seed of the noise, of the truth and of the faults."""
    world: str = "honest"
    """How far the truth is from the layout: as in `flinch run`."""

    def __call__(self) -> None:
        from app.virtual.skin.emulate import Emulation, emulate

        what = Emulation(
            self.link, self.format, self.replay, self.faults, self.only, self.seconds, self.follow
        )
        setup = self.setup(scene=self.scene, seed=self.seed, world=self.world)
        quit_asked = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: quit_asked.set())
        said, lost = emulate(
            what,
            setup,
            WallClock(),
            lambda words: print(f"{words}  (Ctrl-C ends it)", flush=True),
            quit_asked.is_set,
        )
        print(f"{said} frames, {lost} of them taken by nobody in time")


@dataclass(frozen=True)
class SkinCommand:
    """Check a skin against its layout, or emulate one on a virtual serial port."""

    what: tyro.conf.OmitArgPrefixes[
        Annotated[SkinCheck, tyro.conf.subcommand("check", prefix_name=False)]
        | Annotated[SkinEmulate, tyro.conf.subcommand("emulate", prefix_name=False)]
    ]

    def __call__(self) -> None:
        self.what()
