"""One RTDE connection that brings joint states, from its handshake to its end.

The maker's protocol is simple enough to be read here (`wire.py`), and that is worth more than
the client's own receiver: a packet is taken whole, so that position, time and state are of one
moment; bytes that are no RTDE are a fault with a name and not the end of the process; every
answer has a deadline; and reading needs neither a thread nor a wait.
"""

import math
import socket
import struct
from typing import NamedTuple

import numpy as np

from app.errors import RobotError
from app.messages import Array, freeze
from app.robot.ur.dashboard import silent
from app.robot.ur.safety import Report
from app.robot.ur.wire import Kind, Packet, WireError, layout, output_recipe, pack, split
from app.timing import WallClock

RTDE = 30004
LOST = "the connection is lost; check the cable and the controller"
PATIENCE = 2.0  # [s] from the first byte of the handshake to the first state
POLYSCOPE_X = 10  # major version of its controllers, which have no dashboard
E_SERIES = 5  # major version of its controllers: 500 states a second, others have 125
CHUNK, READS = 65536, 4  # bytes a read, reads a call: 1 s of states and more
VARIABLES = {
    "timestamp": "DOUBLE",
    "actual_q": "VECTOR6D",
    "actual_qd": "VECTOR6D",
    "robot_mode": "INT32",
    "safety_mode": "INT32",
    "robot_status_bits": "UINT32",
    "runtime_state": "UINT32",
    "target_speed_fraction": "DOUBLE",
    "speed_scaling": "DOUBLE",
}
_TYPES = list(VARIABLES.values())
_LAYOUT = layout(_TYPES)
_CLOCK = WallClock()


class Sample(NamedTuple):
    """What one packet tells: when [s] on the controller's clock, q (6,) [rad], qd (6,) [rad/s]."""

    timestamp: float
    q: Array
    qd: Array
    report: Report


class Link:
    """Joint states of `host` as they come; a RobotError, in words and in time, when none do."""

    def __init__(self, host: str) -> None:
        self.fault = ""  # why no state comes any more
        self.count = 0  # of the states that came
        self.newest: Sample
        self.major = 0  # of the controller's version: 3 CB3, 5 e-Series, 10 PolyScope X
        self._packets: list[Packet] = []  # whole ones that nobody has looked at
        self._rest = b""
        try:
            self._socket = socket.create_connection((host, RTDE), PATIENCE)
        except OSError as e:
            raise RobotError(silent(host, RTDE, e)) from e
        try:
            self._shake_hands(host)
        except WireError as e:
            self.close()
            raise RobotError(f"{host}:{RTDE} does not answer as a UR does ({e})") from e
        except OSError as e:
            self.close()
            raise RobotError(silent(host, RTDE, e)) from e
        except RobotError:
            self.close()
            raise
        self._socket.setblocking(False)

    def drain(self) -> None:
        """Read what has come, without waiting; the last state of it becomes `newest`."""
        if self.fault:
            return
        try:
            for _ in range(READS):
                self._receive()
                self._take()
        except BlockingIOError:
            pass
        except WireError as e:
            self._end(f"joint states are garbled ({e}); check the cable and the controller")
        except OSError:
            self._end(LOST)

    def close(self) -> None:
        """Leave."""
        self._socket.close()

    def _end(self, why: str) -> None:
        self.fault = why
        self.close()

    # --- the handshake --------------------------------------------------------------------

    def _shake_hands(self, host: str) -> None:
        until = _CLOCK.now() + PATIENCE
        if self._ask(Kind.VERSION, struct.pack(">H", 2), until) != b"\x01":
            raise RobotError(f"{host}:{RTDE} speaks no RTDE 2; a UR needs Polyscope 3.5 or newer")
        version = self._ask(Kind.CONTROLLER, b"", until)
        if len(version) != 16:
            raise WireError(f"a controller's version has 16 bytes, not {len(version)}")
        self.major = int(struct.unpack_from(">I", version)[0])
        rate = 500.0 if self.major >= E_SERIES else 125.0
        types = self._ask(Kind.OUTPUTS, output_recipe(rate, list(VARIABLES)), until)[1:]
        if types != ",".join(_TYPES).encode():
            told = types.decode("ascii", "replace")
            raise RobotError(f"{host}: joint states are refused ({told}); update its Polyscope")
        if self._ask(Kind.START, b"", until) != b"\x01":
            raise RobotError(f"{host}: joint states are refused; start the controller again")
        self._take()
        while not self.count:
            self._wait(until)
            self._receive()
            self._take()

    def _ask(self, kind: int, payload: bytes, until: float) -> bytes:
        """The payload of the answer to a question, which is a packet of the same kind."""
        self._wait(until)
        self._socket.sendall(pack(kind, payload))
        while True:
            while self._packets:
                packet = self._packets.pop(0)
                if packet.kind == kind:
                    return packet.payload
                if packet.kind != Kind.TEXT:
                    raise WireError(f"a packet of kind {packet.kind} where {kind} was asked for")
            self._wait(until)
            self._receive()

    def _wait(self, until: float) -> None:
        """Let the socket be patient until then [s]; TimeoutError when that is over."""
        left = until - _CLOCK.now()
        if left <= 0.0:
            raise TimeoutError
        self._socket.settimeout(left)

    # --- states ---------------------------------------------------------------------------

    def _receive(self) -> None:
        """Read once; what is whole of it becomes packets."""
        data = self._socket.recv(CHUNK)
        if not data:
            raise ConnectionResetError("closed by the other side")
        whole, self._rest = split(self._rest + data)
        self._packets += whole

    def _take(self) -> None:
        """Let the last state among the packets become the newest."""
        states = [p.payload for p in self._packets if _is_state(p)]
        self._packets.clear()
        if states:
            self.newest = _sample(states[-1])
            self.count += len(states)


def _is_state(packet: Packet) -> bool:
    if packet.kind not in (Kind.DATA, Kind.TEXT):
        raise WireError(f"a packet of kind {packet.kind} among the states")
    return packet.kind == Kind.DATA


def _sample(payload: bytes) -> Sample:
    """The state in a data packet, behind the number of its recipe."""
    if len(payload) != 1 + _LAYOUT.size:
        raise WireError(f"a state of {len(payload)} bytes; it has {1 + _LAYOUT.size}")
    timestamp, *flat = _LAYOUT.unpack_from(payload, 1)
    q, qd, report = flat[0:6], flat[6:12], flat[12:]
    if not all(map(math.isfinite, (timestamp, *flat))):
        raise WireError("a value is not finite")
    return Sample(timestamp, freeze(np.array(q)), freeze(np.array(qd)), Report(*report))
