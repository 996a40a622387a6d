"""The process that measures for a simulated skin: `python -m app.sensing.simulation FD FD FD`.

It has a world of its own that follows the other side's: the same bodies, edited and moved on as
each request says. It ends when the other side does, in whatever way.
"""

import os
import pickle
import select
import signal
import socket
import sys
from collections import deque
from mmap import mmap
from typing import BinaryIO, NamedTuple, NoReturn

from app.errors import FlinchError
from app.sensing.error_model import ErrorModel
from app.sensing.measurement import Measurement
from app.sensing.sight import Eyes
from app.sensing.traffic import Size, Traffic
from app.timing import PRIORITY, prefer_this_thread
from app.world.world import Edit, World

PAUSE = 2  # [ms] between two looks for a request; a frame is due tens of them later


class Task(NamedTuple):
    """What is to be simulated; it travels to the process as one pickle."""

    eyes: Eyes
    world: World
    seed: int
    errors: ErrorModel
    latency: float


def size_of(task: Task) -> Size:
    """What the traffic's memory is laid out by."""
    kinds = [s.type for s in task.eyes.skin.sensors]
    return Size(
        tuple(t.zones for t in kinds), max(t.rate_hz for t in kinds), len(task.eyes.links.bodies),
        task.latency,
    )  # fmt: skip


class Gone(Exception):  # noqa: N818  a state of affairs, no error
    """The other side has ended."""


class Line:
    """The line to the other side: edits of the world come along it, and its end is the end."""

    def __init__(self, line: socket.socket) -> None:
        self._file: BinaryIO = line.makefile("rb")
        self._wait = select.poll()
        self._wait.register(line, select.POLLIN)
        self._edits: deque[Edit] = deque()

    def pause(self) -> None:
        """Let a little time pass."""
        if self._wait.poll(PAUSE):
            self._edits.append(self._receive())

    def next_edit(self) -> Edit:
        """The next edit; it is here or on its way."""
        return self._edits.popleft() if self._edits else self._receive()

    def _receive(self) -> Edit:
        try:
            edit: Edit = pickle.load(self._file)
        except (EOFError, ConnectionError, pickle.UnpicklingError) as end:
            raise Gone from end
        return edit


def serve(task: Task, traffic: Traffic, line: Line) -> NoReturn:
    """Answer requests until the other side is `Gone`."""
    eyes, world, seed, errors, _ = task
    # whatever takes long for the first time is done once: trees are built, kernels compiled
    everyone, T_base_link = range(eyes.skin.count), eyes.links.T_base_link
    Measurement(eyes, world, seed, errors).frames(everyone, T_base_link, 0.0)
    measurement, edits = Measurement(eyes, world, seed, errors), 0
    traffic.say_ready()
    # sensors that stand for real ones do not wait for a browser to be done with a picture
    prefer_this_thread(PRIORITY - 1)
    while True:
        request = traffic.next_request()
        if request is None:
            line.pause()
            continue
        for _ in range(request.edits - edits):
            world.edit(line.next_edit())
        edits = request.edits
        world.step(request.time)
        for frame in measurement.frames(request.sensors, request.T_base_link, request.now):
            while traffic.frames.full:
                line.pause()
            traffic.put_frame(frame)
        traffic.requests.drop()


def main(line_fd: int, memory_fd: int, task_fd: int) -> None:
    """Take the task, serve, and tell the other side in one line what went wrong."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C is for the other side
    line = socket.socket(fileno=line_fd)
    try:
        with open(task_fd, "rb") as file:
            task: Task = pickle.load(file)
        traffic = Traffic(memoryview(mmap(memory_fd, 0)), size_of(task))
        serve(task, traffic, Line(line))
    except Gone:
        os._exit(0)  # somebody waits, and there is nothing to tidy up
    except Exception as error:
        told = str(error) if isinstance(error, FlinchError) else repr(error)
        line.sendall(" ".join(told.split()).encode())
        raise


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
