"""`flinch kernels`: compile every kernel now, so that no start has to."""

import sys
from dataclasses import dataclass

from app.cli.interrupt import end_at_once
from app.cli.which import WhichRobot


def print_progress(number: int, of: int, name: str) -> None:
    """One line that is written over: which kernel is being compiled, of how many at the most."""
    end = "" if sys.stderr.isatty() else "\n"
    start = "\r\033[K" if sys.stderr.isatty() else ""
    if end and number % 10 != 1:
        return  # a file or a service's log needs no line for each
    print(f"{start}compiling kernels: {number} of at most {of} ({name})", end=end, flush=True,
          file=sys.stderr)  # fmt: skip


@dataclass(frozen=True)
class Kernels(WhichRobot):
    """Compile every kernel now, with progress; the installation does it. A minute at first, a
    second later on."""

    def __call__(self) -> None:
        from app.compiled import told
        from app.config import Params
        from app.rehearsal import rehearse
        from app.timing import ManualClock
        from app.wiring import build_engine

        end_at_once()
        with told(print_progress):
            engine = build_engine(self.setup(), ManualClock())
            for _ in range(50):  # the simulated sensors' own kernels
                engine.step()
            rehearse(engine.robot, engine.skin, engine.cell, Params())
        print("all kernels are compiled", file=sys.stderr)
