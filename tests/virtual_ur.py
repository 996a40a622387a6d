"""A virtual UR in a process of its own, since the client's constructors hold the interpreter."""

import itertools
import multiprocessing
import os

import numpy as np

from app.robot.ur.emulator.controller import Controller
from app.robot.ur.emulator.faults import parse_fault
from app.robot.ur.emulator.server import Emulator

HOME = np.radians([0.0, -100.0, 110.0, -100.0, -90.0, 0.0])
_count = itertools.count(1)


def own_address():
    """A loopback address that no other test uses, since the ports cannot be chosen."""
    pid, n = os.getpid(), next(_count)
    return f"127.{1 + pid // 250 % 250}.{1 + pid % 250}.{n}"


class VirtualUr:
    """`with VirtualUr("drop@1") as ur:` serves at `ur.host`; attributes and calls go through."""

    def __init__(self, *faults):
        self.host = own_address()
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(theirs, self.host, faults), daemon=True
        )
        self._process.start()
        self._pipe.recv()

    def get(self, name):
        """A field of the controller."""
        return self._ask("get", name)

    def call(self, name, *args):
        """A method of the controller."""
        return self._ask("call", name, *args)

    def _ask(self, *what):
        self._pipe.send(what)
        return self._pipe.recv()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._pipe.send(("end",))
        self._process.join(timeout=5)
        assert self._process.exitcode == 0


def _serve(pipe, host, faults):
    emulator = Emulator(Controller(HOME, [parse_fault(f) for f in faults]), host)
    emulator.start()
    pipe.send("ready")
    while True:
        match pipe.recv():
            case ("get", name):
                pipe.send(emulator.ask(lambda c, name=name: _plain(getattr(c, name))))
            case ("call", name, *args):
                pipe.send(emulator.ask(lambda c, n=name, a=args: _plain(getattr(c, n)(*a))))
            case ("end",):
                emulator.stop()
                return


def _plain(value):
    return list(value) if hasattr(value, "maxlen") else value
