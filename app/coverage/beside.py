"""Coverage at the newest posture, looked at by a process of its own: a look takes as long as
fifty ticks, and nothing here may keep the control thread waiting.

    asker ── Asked ──► process: look ──► Seen

One question at a time; who is asked again before it has answered says no, and nothing queues.
"""

import multiprocessing
import os
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.coverage.look import Look, Subject, look_at
from app.messages import Array

NICE = 10  # less important than a page, and than what a person does beside it
WITHIN = 0.2  # [m] the gap by which what comes should have been seen


class Asked(NamedTuple):
    """Links posed at T_base_link (L, 4, 4), which sensors are working (K,), and a patch of which
    more is wanted; -1: none."""

    T_base_link: Array
    working: NDArray[np.bool_]
    patch: int = -1


class Ways(NamedTuple):
    """The ways to one patch: how many are open, and who sees first on how many of them, from how
    far at most [m]; the sensors by their index, the one with the most ways first."""

    patch: int
    open: int
    first: tuple[tuple[int, int, float], ...]


class Seen(NamedTuple):
    """What came of it.

    gap:   (P,) [m] at which a thing that comes to a patch is first seen, of half of the open ways
           nearer than this; NaN where no way is open.
    share: (L,) of the open ways to each link, by area, seen `WITHIN` before; NaN for none.
    whole: the same of all that moves.   lost: what the sensors that do not work take from it.
    ways:  of the patch that was asked for; None: none was.
    """

    gap: Array
    share: Array
    whole: float
    lost: float
    ways: Ways | None = None


def seen_of(subject: Subject, look: Look, asked: Asked) -> Seen:
    """What a look comes to."""
    working = asked.working
    now, best = look.seen(working), look.seen()
    open_ = ~look.barred
    some = open_.any(axis=1)
    gap = np.full(len(now), np.nan)
    gap[some] = np.nanmedian(now[some], axis=1)
    link, area = subject.patches.link, subject.patches.area
    ways, in_time = open_.sum(axis=1) * area, ((now >= WITHIN) & open_).sum(axis=1) * area
    at_best = ((best >= WITHIN) & open_).sum(axis=1) * area
    count = len(subject.robot.links)
    of, hit = (np.bincount(link, w, minlength=count) for w in (ways, in_time))
    moves = np.any(subject.robot.supports[link] > 0.0, axis=1)
    total = max(float(ways[moves].sum()), 1e-12)
    whole = float(in_time[moves].sum()) / total
    share = np.where(of > 0.0, hit / np.maximum(of, 1e-12), np.nan)
    lost = float(at_best[moves].sum()) / total - whole
    return Seen(gap, share, whole, lost, ways_to(look, asked) if asked.patch >= 0 else None)


def ways_to(look: Look, asked: Asked) -> Ways:
    """Who sees what comes to the patch that was asked for."""
    open_ = ~look.barred[asked.patch]
    gap = np.where(asked.working[:, None], look.gap[:, asked.patch], 0.0)[:, open_]
    seen = gap.max(axis=0, initial=0.0) > 0.0
    first, far = gap.argmax(axis=0)[seen], gap.max(axis=0, initial=0.0)[seen]
    who, count = np.unique(first, return_counts=True)
    found = [
        (int(k), int(n), float(far[first == k].max())) for k, n in zip(who, count, strict=True)
    ]
    return Ways(asked.patch, int(open_.sum()), tuple(sorted(found, key=lambda f: -f[1])))


class Beside:
    """The process; begun by the first question, ended by `close` or with this one."""

    def __init__(self, subject: Subject) -> None:
        self._subject = subject
        self._line: Connection | None = None
        self._process: multiprocessing.process.BaseProcess | None = None
        self._busy = False

    def ask(self, asked: Asked) -> bool:
        """Ask, unless the last question is still open; False then."""
        if self._busy:
            return False
        if self._line is None:
            self._begin()
        assert self._line is not None
        self._line.send(asked)
        self._busy = True
        return True

    def answer(self) -> Seen | None:
        """The answer, if there is one. RuntimeError with the cause where the process has failed."""
        if self._line is None or not self._busy or not self._line.poll():
            return None
        try:
            answer = self._line.recv()
        except EOFError:
            answer = "its process has ended"
        self._busy = False
        if isinstance(answer, str):
            self.close()
            raise RuntimeError(answer)
        found: Seen = answer
        return found

    def close(self) -> None:
        """End the process; a later question begins it anew."""
        if self._line is not None:
            self._line.close()
        if self._process is not None:
            self._process.join(timeout=2.0)
            self._process.kill()
        self._line = self._process = None
        self._busy = False

    def _begin(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._line, theirs = context.Pipe()
        target: Callable[..., None] = _serve
        self._process = context.Process(target=target, args=(theirs, self._subject), daemon=True)
        self._process.start()
        theirs.close()


def _serve(line: Connection, subject: Subject) -> None:
    os.nice(NICE)
    try:
        while True:
            asked: Asked = line.recv()
            found = look_at(subject, asked.T_base_link)
            line.send(seen_of(subject, found, asked))
    except (EOFError, ConnectionError, KeyboardInterrupt):
        return  # the other side has ended
    except Exception as error:
        line.send(repr(error))
        raise
