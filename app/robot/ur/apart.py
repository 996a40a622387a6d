"""Velocity commands from a process of their own.

The client holds the interpreter while it connects and while it leaves, and has been seen to die
when the connection broke in the middle of a command. Neither may touch the control loop. So it
lives apart: a velocity goes there for every tick, and nothing goes out without one. When this
side ends, in whatever way, the other brakes the arm, ends the control program and ends itself.
"""

import socket
import subprocess
import sys
import threading
from multiprocessing.connection import Connection

import numpy as np

from app.errors import RobotError
from app.messages import Array
from app.robot.ur.control import Control, capped
from app.robot.ur.stream import LOST

BEGIN = 30.0  # [s] until the control program must run
END = 5.0  # [s] until the process must have ended
BEHIND = 10  # commands that may be on their way; more are not sent, and the watchdog decides


class ControlApart:
    """`Control` in a process of its own; raises RobotError, in words, when it cannot begin."""

    def __init__(self, host: str, model: str) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", __name__, str(theirs.fileno())],
                pass_fds=[theirs.fileno()],
                stdout=subprocess.DEVNULL,  # the client talks there, and it may be our --json
                start_new_session=True,  # a Ctrl-C is for us: it must live to brake the arm
            )
        self._pipe = Connection(ours.detach())
        self._said, self._behind = "", 0
        try:
            self._pipe.send((host, model))
            said = self._pipe.recv() if self._pipe.poll(BEGIN) else "no control program in time"
        except (EOFError, OSError):
            said = f"{host}: the client has died while it began; see above"
        if said:
            self.close()
            raise RobotError(said)

    @property
    def trouble(self) -> str:
        """Why no command reaches the arm; empty while all is well."""
        try:
            while self._pipe.poll():
                self._said = self._pipe.recv()
                self._behind -= 1
        except (EOFError, OSError):
            self._said = LOST
        return self._said

    def send(self, qd: Array, actual: Array, dt: float) -> Array:
        """Ask for the velocities `qd` (6,) [rad/s]; returns those that went out, at once."""
        if self.trouble or self._behind >= BEHIND:
            return np.zeros_like(qd)
        try:
            self._pipe.send((qd, actual, dt))
        except OSError:
            self._said = LOST
            return np.zeros_like(qd)
        self._behind += 1
        return capped(qd)

    def close(self) -> None:
        """Have the arm braked and the program ended; returns when the process is gone."""
        self._pipe.close()
        try:
            self._process.wait(END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _serve(pipe: Connection) -> None:
    try:
        control = Control(*pipe.recv())
    except RobotError as error:
        pipe.send(str(error))
        return
    try:
        pipe.send("")
        while True:
            control.send(*pipe.recv())
            pipe.send(control.trouble)
    except (EOFError, OSError):
        control.close(threading.Event().wait)


if __name__ == "__main__":
    _serve(Connection(int(sys.argv[1])))
