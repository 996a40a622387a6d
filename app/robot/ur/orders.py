"""What the control thread and the process of the client say to each other: packets, framed as
RTDE's are.

    BEGIN   to the client: at which host, and which model of arm is expected there
    BEGUN   from it: why no control program runs; empty when one does
    ORDER   to it: a velocity, how fast the arm moves, how long a tick is
    ANSWER  from it: what went out, and why no more does
"""

import struct
from typing import NamedTuple

import numpy as np

from app.messages import Array
from app.robot.ur.wire import pack

BEGIN, BEGUN, ORDER, ANSWER = b"bBoA"
_ORDER, _ANSWER = struct.Struct(">I13d"), struct.Struct(">I6d")


class Order(NamedTuple):
    """Ask for `qd` (6,) [rad/s] while the arm moves with `actual` (6,), for `dt` [s]."""

    number: int
    qd: Array
    actual: Array
    dt: float


class Answer(NamedTuple):
    """To all orders up to `number`: `sent` (6,) [rad/s] was written to the controller."""

    number: int
    sent: Array
    trouble: str


def pack_order(order: Order) -> bytes:
    """The packet of an order."""
    return pack(ORDER, _ORDER.pack(order.number, *order.qd, *order.actual, order.dt))


def read_order(payload: bytes) -> Order:
    """The order in a packet."""
    number, *flat = _ORDER.unpack(payload)
    return Order(number, np.array(flat[0:6]), np.array(flat[6:12]), flat[12])


def pack_answer(answer: Answer) -> bytes:
    """The packet of an answer."""
    head = _ANSWER.pack(answer.number, *answer.sent)
    return pack(ANSWER, head + answer.trouble.encode())


def read_answer(payload: bytes) -> Answer:
    """The answer in a packet."""
    number, *sent = _ANSWER.unpack_from(payload)
    return Answer(number, np.array(sent), payload[_ANSWER.size :].decode())
