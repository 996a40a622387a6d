"""Trials on several processes: a trial is a pure function of its specification.

What comes out does not depend on how many processes there are, nor on the order. A process that
dies, or that takes longer than it may, is its trial's end and not the study's.
"""

import os
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Generic, NamedTuple, NoReturn, TypeVar

from app.errors import ConfigError, StudyError
from app.studies.worker import BEGUN, DIED, LATE, Answer, Worker

S = TypeVar("S")
R = TypeVar("R")
# each process has one thread: with more the processes get into each other's way
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
PATIENCE = 5.0  # [s] for a process that has closed its line to be gone
TRIES = 2  # of a trial whose process dies: the machine may have run out of memory by chance


class Fate(NamedTuple, Generic[S, R]):
    """What becomes of a trial that gives no result.

    lost:  its result from its specification and the cause.
    limit: how long it may take, of the wall's clock [s].
    """

    lost: Callable[[S, str], R]
    limit: Callable[[S], float]


def each(trial: Callable[[S], R], specs: Sequence[S], jobs: int = 1) -> Iterator[R]:
    """The results of `trial`, a function of a module, in the order in which they are done.

    With one job in this very process. StudyError if a process dies.
    """
    if jobs == 1:
        return map(trial, specs)
    fate: Fate[S, R] = Fate(_stop, lambda spec: float("inf"))
    return (result for _, result in apart(trial, specs, jobs, fate))


def _stop(spec: object, cause: str) -> NoReturn:
    raise StudyError(f"a trial of the study gave no result ({cause}); run it again")


@dataclass
class _Task(Generic[S]):
    """A trial that is being run, the how manieth time, and until when it may take: without end
    until its process is there and begins with it."""

    spec: S
    number: int
    until: float = float("inf")


def apart(
    trial: Callable[[S], R], specs: Sequence[S], jobs: int, fate: Fate[S, R]
) -> Iterator[tuple[S, R]]:
    """Each trial and its result, as they are done, in `jobs` other processes.

    What a trial raises is raised here.
    """
    todo = deque(_Task(spec, 1) for spec in specs)
    idle: list[Worker[S, R]] = []
    busy: dict[Connection, tuple[Worker[S, R], _Task[S]]] = {}
    with one_thread():
        try:
            while todo or busy:
                while todo and len(busy) < jobs:
                    worker, task = idle.pop() if idle else Worker(trial), todo.popleft()
                    worker.begin(task.spec)
                    busy[worker.line] = worker, task
                for line in _ready(busy):
                    worker, task = busy[line]
                    heard = worker.hear() if line.poll() else LATE
                    if heard is BEGUN:
                        task.until = time.monotonic() + fate.limit(task.spec)
                        continue
                    del busy[line]
                    if isinstance(heard, Answer):
                        idle.append(worker)
                        yield task.spec, heard.result
                        continue
                    cause = worker.end(PATIENCE if heard is DIED else 0.0)
                    if heard is DIED and task.number < TRIES:
                        todo.append(_Task(task.spec, task.number + 1))
                        continue
                    if heard is LATE:
                        cause = f"it took longer than {fate.limit(task.spec):g} s"
                    yield task.spec, fate.lost(task.spec, cause)
        finally:
            for worker in [*idle, *(w for w, _ in busy.values())]:
                worker.end()


def _ready(busy: dict[Connection, tuple[Worker[S, R], _Task[S]]]) -> list[Connection]:
    """Waits for workers that have said something, have died or are late."""
    left = min(task.until for _, task in busy.values()) - time.monotonic()
    ready = wait(list(busy), None if left == float("inf") else max(left, 0.0))
    now = time.monotonic()
    return [line for line, (_, task) in busy.items() if line in ready or now >= task.until]


def shard_of(specs: Sequence[S], shard: str) -> Sequence[S]:
    """Every N-th of `specs` from the i-th on, for a shard 'i/N' with i from 1 to N."""
    i, n = parts_of(shard)
    return specs[i - 1 :: n]


def parts_of(shard: str) -> tuple[int, int]:
    """The two numbers of a shard 'i/N'; ConfigError for anything else."""
    i, _, n = shard.partition("/")
    if not (i.isdecimal() and n.isdecimal() and 1 <= int(i) <= int(n)):
        raise ConfigError(f"shard = {shard!r}; give I/N with I from 1 to N, such as 1/4")
    return int(i), int(n)


@contextmanager
def one_thread() -> Iterator[None]:
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
