"""Velocity commands from a process of their own, and a deadline for each of its answers.

The client holds the interpreter while it connects and while it leaves, may wait for minutes, and
ends its process on bytes that are no RTDE. So it lives apart: an order goes there in every tick,
and what has come back is read; neither waits. Its death costs the arm its commands, so that the
controller's own watchdog stops it; states go on coming in here (`link.py`) and show it.
"""

import select
import socket
import subprocess
import sys
import threading

import numpy as np

from app.errors import RobotError
from app.messages import Array
from app.robot.ur.limits import WATCHDOG
from app.robot.ur.orders import ANSWER, BEGIN, BEGUN, Order, pack_order, read_answer
from app.robot.ur.wire import Packet, WireError, pack, split
from app.timing import WallClock

CLIENT = "app.robot.ur.client"
BEGINNING = 8.0  # [s] until the control program must run; the client gives its program 5
ANSWERING = 1.0  # [s] until an order must be answered
LEAVING = 3.0  # [s] until the process must have ended
LOOK = 0.1  # [s] between two looks whether to give up
BEHIND = 10  # orders that may be on their way; more are not sent, and the watchdog decides
DIED = "the control program's client has died (see the console); press Run to begin anew"
HANGS = (
    f"the control program's client gave no answer for {ANSWERING:g} s and was ended; press Run to "
    "begin anew"
)
_CLOCK = WallClock()


class ControlApart:
    """A control program on `host`, fed by a process of its own; a RobotError, in words and in
    time, when it cannot begin. `leave` gives up the wait for its beginning."""

    def __init__(self, host: str, model: str, leave: threading.Event) -> None:
        self._socket, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", CLIENT, str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # the client talks there, and it may be our --json
                start_new_session=True,  # a Ctrl-C is for us: it must live to brake the arm
            )
        self._socket.setblocking(False)
        self._rest = b""
        self._said = ""  # why no order is obeyed
        self._given = self._answered = 0  # numbers of the newest order and of its newest answer
        self._waiting = 0.0  # [s] since when an answer is waited for
        self._sent, self._sent_at = np.zeros(6), -np.inf
        said = self._begin(host, model, leave)
        if said:
            self.close()
            raise RobotError(said)

    def trouble(self, now: float) -> str:
        """Why no order reaches the arm at `now` [s]; empty while all is well."""
        self._listen(now)
        waits = self._given > self._answered and now - self._waiting > ANSWERING
        if waits and not self._said:
            self._said = HANGS
            self._process.kill()
        return self._said

    def send(self, qd: Array, actual: Array, dt: float, now: float) -> None:
        """Ask for the velocities `qd` (6,) [rad/s] of an arm that moves with `actual` (6,); an
        order that cannot go at once does not go."""
        if self._said or self._given - self._answered >= BEHIND:
            return
        if self._given == self._answered:
            self._waiting = now
        order = pack_order(Order(self._given + 1, qd, actual, dt))
        try:
            whole = self._socket.send(order) == len(order)
        except OSError:
            whole = False
        if whole:
            self._given += 1
        else:
            self._said = self._said or DIED

    def sent(self, now: float) -> Array:
        """The newest velocity (6,) [rad/s] that is known to be written to the controller; zero
        when that is longer ago than the controller's watchdog is patient."""
        self._listen(now)
        alive = not self._said and now - self._sent_at <= 1.0 / WATCHDOG
        return self._sent if alive else np.zeros(6)

    def close(self) -> None:
        """Have the arm braked and the program ended; returns when the process is gone."""
        self._socket.close()
        try:
            self._process.wait(LEAVING)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _begin(self, host: str, model: str, leave: threading.Event) -> str:
        """Why no control program runs; empty when one does."""
        until = _CLOCK.now() + BEGINNING
        try:
            self._socket.send(pack(BEGIN, f"{host}\n{model}".encode()))
            while _CLOCK.now() < until and not leave.is_set():
                if select.select([self._socket], [], [], LOOK)[0]:
                    for packet in self._receive():
                        if packet.kind == BEGUN:
                            return packet.payload.decode()
        except (OSError, WireError):
            return f"{host}: the client has died while it began; see the console"
        self._process.kill()
        return (
            f"{host}: no control program began within {BEGINNING:g} s; look at the pendant, and "
            "start the controller again if it does not answer"
        )

    def _listen(self, now: float) -> None:
        """Take the answers that have come, without waiting."""
        try:
            while not self._said:
                for packet in self._receive():
                    if packet.kind == ANSWER:
                        answer = read_answer(packet.payload)
                        self._answered, self._waiting = answer.number, now
                        self._sent, self._sent_at = answer.sent, now
                        self._said = answer.trouble
        except BlockingIOError:
            pass
        except (OSError, WireError):
            self._said = DIED

    def _receive(self) -> list[Packet]:
        data = self._socket.recv(4096)
        if not data:
            raise ConnectionResetError("the other side has ended")
        packets, self._rest = split(self._rest + data)
        return packets
