"""Trials on several processes: a trial is a pure function of its specification.

What comes out does not depend on how many processes there are, nor on the order.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from typing import TypeVar

from app.errors import ConfigError, StudyError

S = TypeVar("S")
R = TypeVar("R")
# each process has one thread: with more the processes get into each other's way
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
WAITING = 4  # trials a process that wait for it, so that none is idle


def each(trial: Callable[[S], R], specs: Sequence[S], jobs: int = 1) -> Iterator[R]:
    """The results of `trial`, a function of a module, in the order in which they are done.

    StudyError if a process dies.
    """
    if jobs == 1:
        yield from map(trial, specs)
        return
    with _one_thread(), ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        rest, pending = iter(specs), set[Future[R]]()
        try:
            while True:
                while len(pending) < WAITING * jobs and (spec := next(rest, None)) is not None:
                    pending.add(pool.submit(trial, spec))
                if not pending:
                    return
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        except BrokenProcessPool as died:
            raise StudyError("a process of the study has died; run it again") from died
        finally:
            pool.shutdown(cancel_futures=True)


def shard_of(specs: Sequence[S], shard: str) -> Sequence[S]:
    """Every N-th of `specs` from the i-th on, for a shard 'i/N' with i from 1 to N."""
    i, _, n = shard.partition("/")
    if not (i.isdecimal() and n.isdecimal() and 1 <= int(i) <= int(n)):
        raise ConfigError(f"shard = {shard!r}; give I/N with I from 1 to N, such as 1/4")
    return specs[int(i) - 1 :: int(n)]


@contextmanager
def _one_thread() -> Iterator[None]:
    """Processes that begin meanwhile have one thread for their algebra."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
