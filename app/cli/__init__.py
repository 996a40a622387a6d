"""The front door: one file a command. Wires rooms, decides nothing.

What a command needs is imported when it is called: `--help` must not wait for compilers, meshes
and the page.
"""

import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from typing import Any

import tyro

from app.cli.bench import Bench
from app.cli.benchmark import Benchmark
from app.cli.calibrate import Calibrate
from app.cli.compare import Compare
from app.cli.coverage import Coverage
from app.cli.doctor import Doctor
from app.cli.experiments import Experiment
from app.cli.export import Export
from app.cli.gallery import Gallery
from app.cli.interrupt import NUMBERS
from app.cli.kernels import Kernels
from app.cli.new_robot import NewRobot
from app.cli.place import PlaceCommand
from app.cli.record_skin import RecordSkin
from app.cli.replay import Replay
from app.cli.run import Run
from app.cli.scarce import scarce
from app.cli.settings import Settings
from app.cli.skin import SkinCommand
from app.cli.ur import Ur
from app.config_names import moved
from app.errors import ConfigError, FlinchError

__all__ = ["COMMANDS", "Run", "main"]

COMMANDS: dict[str, Callable[..., Any]] = {
    "run": Run,
    "replay": Replay,
    "compare": Compare,
    "export": Export,
    "gallery": Gallery,
    "bench": Bench,
    "benchmark": Benchmark,
    "doctor": Doctor,
    "coverage": Coverage,
    "place": PlaceCommand,
    "calibrate": Calibrate,
    "skin": SkinCommand,
    "record-skin": RecordSkin,
    "experiment": Experiment,
    "ur": Ur,
    "new-robot": NewRobot,
    "settings": Settings,
    "kernels": Kernels,
}


def main(args: Sequence[str] | None = None) -> int:
    """Entry point; a user's error is one line on standard error and exit code 1."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    commands = tyro.extras.SubcommandApp()
    for name, command in COMMANDS.items():
        commands.command(name=name)(command)
    handlers = {number: signal.getsignal(number) for number in NUMBERS}
    given = list(sys.argv[1:] if args is None else args)
    try:
        _refuse_old_names(given)
        run = commands.cli(args=args, prog="flinch", description="A robot arm that gives way.")
        return run() or 0
    except FlinchError as error:
        print(f"flinch: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # who reads what is printed has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (OSError, MemoryError, ImportError, RuntimeError) as error:
        words = scarce(error)
        if not words:
            raise
        print(f"flinch: {words}", file=sys.stderr)
        return 1
    finally:
        if threading.current_thread() is threading.main_thread():
            for number, handler in handlers.items():
                signal.signal(number, handler)


def _refuse_old_names(args: Sequence[str]) -> None:
    """ConfigError for a setting's flag of before, which says what it is called now."""
    for flag in (a.split("=")[0] for a in args[1:] if a.startswith("--")):
        remedy = moved(flag[2:].replace("-", "_")) if args[0] == "run" else ""
        if remedy:
            raise ConfigError(f"{flag} is no flag any more; {remedy}")
