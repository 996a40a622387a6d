"""The process of the client: it begins a control program, obeys orders, and leaves.

When the other side ends, in whatever way, it brakes the arm, ends the control program and ends
itself. A call of the client that does not come back ends the process, by an alarm that needs
nobody: the other side may be gone.
"""

import contextlib
import os
import resource
import signal
import socket
import sys
import threading
from collections.abc import Iterator

from app.errors import RobotError
from app.robot.ur.control import Control
from app.robot.ur.orders import BEGUN, ORDER, Answer, pack_answer, read_order
from app.robot.ur.wire import Packet, pack, split

# When its connection is lost, the client connects anew by itself, uploads a program, on which
# nobody has set a watchdog, and gives it the last velocity again. A process that may open nothing
# beside its standard streams cannot do any of that: only a person begins a program.
HANDLES = 3
BEGINNING, CALL, LEAVING = 15.0, 5.0, 5.0  # [s] that the client's calls may take


def _serve(orders: socket.socket) -> None:
    packets = _packets(orders)
    (begin,) = next(packets)
    try:
        with _at_most(BEGINNING):
            control = Control(*begin.payload.decode().split("\n"))
    except RobotError as error:
        orders.sendall(pack(BEGUN, str(error).encode()))
        return
    resource.setrlimit(resource.RLIMIT_NOFILE, (HANDLES, HANDLES))
    with contextlib.suppress(OSError):  # the other side has ended: so do we
        orders.sendall(pack(BEGUN))
        for come in packets:
            newest = [p for p in come if p.kind == ORDER][-1]  # the others are late
            order = read_order(newest.payload)
            with _at_most(CALL):
                sent = control.send(order.qd, order.actual, order.dt)
                answer = Answer(order.number, sent, control.trouble)
            orders.sendall(pack_answer(answer))
    with _at_most(LEAVING):
        control.close(threading.Event().wait)
    os._exit(0)  # not through the client's destructor, which sleeps


def _packets(orders: socket.socket) -> Iterator[list[Packet]]:
    """What has come, as often as something has; until the other side ends."""
    rest = b""
    while data := orders.recv(4096):
        come, rest = split(rest + data)
        if come:
            yield come


@contextlib.contextmanager
def _at_most(seconds: float) -> Iterator[None]:
    """The default action of an alarm ends a process even from within the client's code."""
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


if __name__ == "__main__":
    with socket.socket(fileno=int(sys.argv[1])) as inherited:
        _serve(inherited)
