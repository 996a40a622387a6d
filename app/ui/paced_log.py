"""The log of all that a stranger can cause: it shall tell, and never fill a disk.

Of each kind the first line is written at once. What follows within `PERIOD` is only counted,
and summed up in one line when the period ends, for as long as it goes on.
"""

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

PERIOD = 10.0  # [s] one line of a kind
LONGEST = 300  # characters of a line

Later = Callable[..., Any]  # seconds, function, its arguments


@dataclass
class _Hushed:
    """What was not written since the last line of its kind."""

    count: int = 0
    last: str = ""


class PacedLog:
    """Warnings by kind. The kinds are words of this program: never what a stranger sent."""

    def __init__(self, log: logging.Logger, later: Later | None = None) -> None:
        """`later` calls a function after so many seconds; the running loop's by default."""
        self.muted = False  # while the program knocks at its own door
        self._log = log
        self._later = later or (lambda *args: asyncio.get_running_loop().call_later(*args))
        self._hushed: dict[str, _Hushed] = {}

    def tell(self, kind: str, text: str, error: BaseException | None = None) -> None:
        """Write the line, with the trace of `error`, or count it."""
        if self.muted:
            return
        hushed = self._hushed.get(kind)
        if hushed is not None:
            hushed.count, hushed.last = hushed.count + 1, text
            return
        self._log.warning("%s", plain(text), exc_info=error)
        self._hush(kind)

    def _hush(self, kind: str) -> None:
        self._hushed[kind] = _Hushed()
        self._later(PERIOD, self._sum_up, kind)

    def _sum_up(self, kind: str) -> None:
        hushed = self._hushed.pop(kind)
        if hushed.count:
            more = f"{hushed.count} more like it in {PERIOD:g} s"
            self._log.warning("%s; the last: %s", more, plain(hushed.last))
            self._hush(kind)


class Teller(logging.Handler):
    """Hands what a library logs to the paced log, a line for each without its trace."""

    def __init__(self, paced: PacedLog) -> None:
        super().__init__(logging.WARNING)
        self._paced = paced

    def emit(self, record: logging.LogRecord) -> None:
        error = record.exc_info[1] if record.exc_info else None
        why = f": {type(error).__name__}: {error}" if error is not None else ""
        self._paced.tell(str(record.msg), f"{record.getMessage()}{why}")


def library_logger(name: str, paced: PacedLog) -> logging.Logger:
    """A logger of its own for a library's server: nothing of it reaches other handlers."""
    logger = logging.Logger(name, logging.WARNING)
    logger.addHandler(Teller(paced))
    return logger


def plain(text: str) -> str:
    """What a stranger sent may be part of it: nothing that a terminal would obey, nor too long."""
    return "".join(c if c.isascii() and c.isprintable() else "?" for c in text[:LONGEST])
