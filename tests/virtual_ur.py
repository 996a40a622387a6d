"""Virtual URs in a process of their own, since a machine's stall would stall both sides at once;
and what an engine does with its arm."""

import itertools
import multiprocessing
import os
from collections.abc import Sequence

import numpy as np

from app.timing import WallClock
from app.virtual.ur.controller import UrController
from app.virtual.ur.faults import parse_fault
from app.virtual.ur.server import UrServer

HOME = np.radians([0.0, -100.0, 110.0, -100.0, -90.0, 0.0])
ONE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
LONGEST = 0.25  # [s] of a call: a busy machine takes some, a wait for the other side a second
CLOCK = WallClock()
_count = itertools.count(1)
_served = None


def own_address():
    """A loopback address that no other test uses, since the ports cannot be chosen."""
    pid, n = os.getpid(), next(_count)
    return f"127.{1 + pid // 250 % 250}.{1 + pid % 250}.{n}"


class VirtualUr:
    """`with VirtualUr("drop@1") as ur:` serves at `ur.host`; attributes and calls go through."""

    def __init__(self, *faults):
        self.host = own_address()
        self._ask("serve", faults)

    def get(self, name):
        """A field of the controller."""
        return self._ask("get", name)

    def call(self, name, *args):
        """A method of the controller."""
        return self._ask("call", name, *args)

    def move(self, speed):
        """Move the fourth joint [rad/s] without a client, and without a watchdog."""
        self.call("upload", "def rtde_control():\nend\n")
        numbers = [0.0, 0.0, 0.0, speed, 0.0, 0.0, 40.0, 0.002]
        registers = {f"input_double_register_{i}": x for i, x in enumerate(numbers)}
        self.call("write", registers | {"input_int_register_0": 9})

    def _ask(self, *what):
        pipe = _pipe()
        pipe.send((self.host, *what))
        return pipe.recv()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._ask("end")


def drive(arm, seconds, speed=0.0):
    """What an engine does with its arm; the last report, and the last velocity that went out."""
    report, applied, _ = timed_drive(arm, seconds, speed)
    return report, applied


def timed_drive(arm, seconds, speed=0.0):
    """The same, and how long the longest call took [s]."""
    begin = CLOCK.now()
    report = applied = None
    longest = 0.0
    for k in range(max(1, round(seconds * 250))):
        CLOCK.sleep_until(begin + 0.004 * k)
        called = CLOCK.now()
        arm.state(called)
        report = arm.report(called)
        applied = arm.send(speed * ONE, 0.004)
        longest = max(longest, CLOCK.now() - called)
    return report, applied, longest


def driven_until(arm, wanted, speed=0.0, limit=10.0):
    """Drive until the report is as wanted; fails after a while."""
    for _ in range(round(limit / 0.02)):
        report, _ = drive(arm, 0.02, speed)
        if wanted(report):
            return report
    raise AssertionError(f"not within {limit} s; the arm says {report}")


def _pipe():
    """To the process of the virtual URs, which begins with the first of them."""
    global _served
    if _served is None:
        context = multiprocessing.get_context("spawn")
        _served, theirs = context.Pipe()
        context.Process(target=_serve, args=(theirs,), daemon=True).start()
        theirs.close()
    return _served


def _serve(pipe):
    emulators = {}
    while True:
        try:
            host, *what = pipe.recv()
        except EOFError:
            return
        match what:
            case ("serve", faults):
                controller = UrController(HOME, [parse_fault(f) for f in faults])
                emulators[host] = UrServer(controller, host)
                answer = emulators[host].start()
            case ("get", name):
                answer = emulators[host].ask(lambda c, name=name: _plain(getattr(c, name)))
            case ("call", name, *args):
                answer = emulators[host].ask(lambda c, n=name, a=args: _plain(getattr(c, n)(*a)))
            case ("end",):
                answer = emulators.pop(host).stop()
        pipe.send(answer)


def _plain(value):
    return list(value) if hasattr(value, "maxlen") else value


def standing_after(trace: Sequence[tuple[float, float]], since: float) -> float:
    """Seconds from `since` until the arm stood for the rest of the trace; inf if it never did."""
    moving = [t for t, speed in trace if speed > 0.0]
    last = moving[-1] if moving else -np.inf
    if not trace or last >= trace[-1][0]:
        return np.inf
    return float(max(0.0, last - since))
