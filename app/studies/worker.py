"""A process that runs one trial after another, for as long as its parent lives."""

import os
import signal
from collections.abc import Callable
from contextlib import suppress
from enum import Enum
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from threading import Thread
from typing import Generic, NamedTuple, TypeVar, cast

S = TypeVar("S")
R = TypeVar("R")


class Heard(Enum):
    """What a worker is heard of that is no answer."""

    BEGUN = "has begun with the trial"
    DIED = "is no more"
    LATE = "takes too long"


BEGUN, DIED, LATE = Heard


class Answer(NamedTuple, Generic[R]):
    """Of a trial."""

    result: R


class Worker(Generic[S, R]):
    """The parent's end of it."""

    def __init__(self, trial: Callable[[S], R]) -> None:
        """Starts it; `trial` is a function of a module."""
        context = get_context("spawn")
        self.line: Connection
        self.line, theirs = context.Pipe()
        self._process = context.Process(target=_work, args=(trial, theirs), daemon=True)
        # Ctrl-C reaches all processes of a terminal; what then ends the study is the parent
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()

    def begin(self, spec: S) -> None:
        """Hand it a trial; one that is dead is found out when it should answer."""
        with suppress(BrokenPipeError, ConnectionResetError):
            self.line.send(spec)

    def hear(self) -> "Answer[R] | Heard":
        """What it says next, or that it died; raises what the trial has raised."""
        try:
            said = self.line.recv()
        except (EOFError, ConnectionResetError):
            return DIED
        if isinstance(said, Exception):
            raise said
        return cast("Answer[R] | Heard", said)

    def end(self, patience: float = 0.0) -> str:
        """End it, and say how it had ended if it does so by itself within `patience` [s]."""
        self._process.join(patience)
        code = self._process.exitcode
        self._process.kill()
        self._process.join()
        self.line.close()
        how = "" if code is None else signal_name(-code) if code < 0 else f"exit code {code}"
        return f"its process died ({how})" if how else "its process was ended"


def signal_name(number: int) -> str:
    """Such as SIGKILL."""
    known = {s.value: s.name for s in signal.Signals}
    return known.get(number, f"signal {number}")


def _work(trial: Callable[[S], R], line: Connection) -> None:
    Thread(target=_leave_with_parent, daemon=True).start()
    with suppress(EOFError, BrokenPipeError):  # the parent has ended
        while True:
            spec = line.recv()
            line.send(BEGUN)
            try:
                said: Answer[R] | Exception = Answer(trial(spec))
            except Exception as error:
                said = error
            line.send(said)


def _leave_with_parent() -> None:
    """A parent that is killed does not leave trials behind that nobody waits for."""
    parent = parent_process()
    assert parent is not None
    wait([parent.sentinel])
    os._exit(1)
