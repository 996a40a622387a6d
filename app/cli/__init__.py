"""The front door: one file a command. Wires rooms, decides nothing.

What a command needs is imported when it is called: `--help` must not wait for compilers, meshes
and the page.
"""

import logging
import sys
from collections.abc import Callable, Sequence
from typing import Any

import tyro

from app.cli.bench import Bench
from app.cli.doctor import Doctor
from app.cli.experiment import Experiment
from app.cli.kernels import Kernels
from app.cli.new_robot import NewRobot
from app.cli.ranges import CalibrateRanges
from app.cli.run import Run
from app.cli.skin import CalibrateFilter, SkinCommand
from app.cli.ur import Ur
from app.errors import FlinchError

__all__ = ["COMMANDS", "Run", "main"]

COMMANDS: dict[str, Callable[..., Any]] = {
    "run": Run,
    "bench": Bench,
    "doctor": Doctor,
    "calibrate-filter": CalibrateFilter,
    "calibrate-ranges": CalibrateRanges,
    "skin": SkinCommand,
    "experiment": Experiment,
    "ur": Ur,
    "new-robot": NewRobot,
    "kernels": Kernels,
}


def main(args: Sequence[str] | None = None) -> int:
    """Entry point; a user's error is one line on standard error and exit code 1."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    app = tyro.extras.SubcommandApp()
    for name, command in COMMANDS.items():
        app.command(name=name)(command)
    try:
        app.cli(args=args, prog="flinch", description="A robot arm that gives way.")()
    except FlinchError as error:
        print(f"flinch: {error}", file=sys.stderr)
        return 1
    return 0
