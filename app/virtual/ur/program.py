"""What the control program does that `ur-rtde` uploads, as its script reads.

Each cycle it reads a command from input register 0 and its arguments from the double
registers, and answers in output register 0: 1 = ready for a command, 2 = done with it.

A velocity command starts a thread that repeats the newest velocity for ever: `time` is only
how long one repetition lasts before the next target is looked at. So an arm that gets no more
commands goes on moving, unless a watchdog on the command register ends the program.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from app.messages import Array

NONE, SPEED_J, SPEED_STOP, SET_WATCHDOG, STOP_SCRIPT = 0, 9, 15, 35, 255
READY, DONE = 1, 2
LOADING = 0.1  # [s] from the upload to the first cycle
STOPJ = 2.0  # [rad/s^2] where a command gives no deceleration


class Registers(Protocol):
    """What a program sees of its controller."""

    def int_in(self, index: int) -> int: ...
    def double_in(self, index: int) -> float: ...
    def int_out(self, index: int, value: int) -> None: ...
    def since_write(self) -> float: ...


@dataclass(frozen=True, eq=False, slots=True)
class Drive:
    """What the program asks of the joints: velocity (6,) [rad/s], acceleration [rad/s^2], and
    for how long [s] at least."""

    target: Array
    acceleration: float
    time: float = 0.0


class UploadedProgram:
    """The control program from its upload to its end; `ended` says why."""

    def __init__(self, registers: Registers) -> None:
        self.ended = ""
        self._registers = registers
        self._loading = LOADING
        self._busy = False
        self._watchdog = 0.0  # [s] allowed between two writes, 0 = none
        self._stopping = False
        self._waits = 0.0  # [s] until the velocity thread looks for a new target
        self._speeding = False
        self._wanted = Drive(np.zeros(6), STOPJ)
        self.drive = Drive(np.zeros(6), STOPJ)

    @property
    def running(self) -> bool:
        """Has the first cycle begun?"""
        return self._loading <= 0.0

    def step(self, still: bool, dt: float) -> None:
        """One cycle of the controller; `still`: no joint moves."""
        if not self.running:
            self._loading -= dt
            if self.running:
                self._registers.int_out(0, READY)
            return
        if self._watchdog and self._registers.since_write() > self._watchdog:
            self.ended = "no command came in time (watchdog)"
            return
        if self._stopping:
            if not still:
                return
            self._stopping = False
            self._registers.int_out(0, DONE)
        self._command(self._registers.int_in(0))
        self._waits -= dt
        if self._speeding and self._waits <= 0.0:
            self.drive = self._wanted
            self._waits = self.drive.time

    def _command(self, command: int) -> None:
        r = self._registers
        if command == SPEED_J:
            target = np.array([r.double_in(i) for i in range(6)])
            self._wanted = Drive(target, r.double_in(6), r.double_in(7))
            self._speeding = True
            r.int_out(0, READY)
        elif command == NONE:
            self._busy = False
            r.int_out(0, READY)
        elif not self._busy:
            self._busy = True
            self._once(command)

    def _once(self, command: int) -> None:
        r = self._registers
        if command == SPEED_STOP:
            self._speeding, self._stopping, self._waits = False, True, 0.0
            self.drive = Drive(np.zeros(6), r.double_in(0) or STOPJ)
        elif command == SET_WATCHDOG:
            self._watchdog = 1.0 / r.double_in(0) if r.double_in(0) > 0.0 else 0.0
            r.int_out(0, DONE)
        elif command == STOP_SCRIPT:
            self.ended = "asked for by the client"
        else:
            self.ended = f"command {command} is not emulated"
