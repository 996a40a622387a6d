"""The front door: one file a command. Wires rooms, decides nothing."""

import logging
import sys
from collections.abc import Sequence

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

__all__ = ["Run", "main"]


def main(args: Sequence[str] | None = None) -> int:
    """Entry point; a user's error is one line on standard error and exit code 1."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    app = tyro.extras.SubcommandApp()
    app.command(name="run")(Run)
    app.command(name="bench")(Bench)
    app.command(name="doctor")(Doctor)
    app.command(name="calibrate-filter")(CalibrateFilter)
    app.command(name="calibrate-ranges")(CalibrateRanges)
    app.command(name="skin")(SkinCommand)
    app.command(name="experiment")(Experiment)
    app.command(name="ur")(Ur)
    app.command(name="new-robot")(NewRobot)
    app.command(name="kernels")(Kernels)
    try:
        command = app.cli(args=args, prog="flinch", description="A robot arm that gives way.")
        command()
    except FlinchError as error:
        print(f"flinch: {error}", file=sys.stderr)
        return 1
    return 0
