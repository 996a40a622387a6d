"""`flinch ur emulate`: a virtual UR on this machine."""

import signal
import threading
from dataclasses import dataclass
from typing import Literal

import tyro

from app.errors import ConfigError


@dataclass(frozen=True)
class Ur:
    """A virtual UR controller with an arm behind it, for trying out --driver ur:HOST."""

    what: tyro.conf.Positional[Literal["emulate"]]
    host: str = "127.0.0.1"
    """Address to serve on; several live side by side on 127.0.0.2, 127.0.0.3, ..."""
    faults: tuple[str, ...] = ()
    """drop@T[:S], mute@T[:S], stall@T[:S], corrupt@T[:S], silent@T[:S], protective@T,
    emergency@T, slider@T:F, reduced@T (seconds after the first motion), local, off, silent,
    cb3 (an older controller), polyscopex (a newer one)."""
    home_deg: tuple[float, ...] = ()
    """Posture to begin in [degrees], six values; default: the UR10e's home."""
    seconds: float = 0.0
    """End after this time [s]; 0 goes on until Ctrl-C."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.seconds < 1e6:
            raise ConfigError(f"seconds = {self.seconds:g}; give a positive number, or 0")
        if len(self.home_deg) not in (0, 6):
            raise ConfigError(f"home-deg has {len(self.home_deg)} values; a UR has six joints")

    def __call__(self) -> None:
        from app.robot.model import find_robot, load_robot
        from app.robot.tables import Choice
        from app.virtual.ur.controller import UrController
        from app.virtual.ur.faults import parse_fault
        from app.virtual.ur.server import UrServer

        faults = [parse_fault(text) for text in self.faults]
        choice = Choice(home_deg=self.home_deg)
        home = load_robot(find_robot("ur10e"), choice).home
        controller = UrController(home, faults, lambda line: print(line, flush=True))
        emulator = UrServer(controller, self.host)
        quit_asked = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: quit_asked.set())
        emulator.start()
        print(f"A virtual UR10e is at {self.host}  (Ctrl-C ends it)", flush=True)
        quit_asked.wait(self.seconds or None)
        emulator.stop()
