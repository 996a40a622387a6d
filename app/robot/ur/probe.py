"""Questions to a UR controller with plain sockets and short patience.

The constructors of `ur-rtde` hold the interpreter until the other side answers, and would hold
the control loop and the page with it. So nothing is constructed before a probe was answered.
"""

import socket
import struct

from app.errors import RobotError
from app.robot.ur.wire import Kind, WireError, pack, split

DASHBOARD, SCRIPT, RTDE = 29999, 30003, 30004
PATIENCE = 1.0  # [s]


def probe(host: str) -> None:
    """Does an RTDE server answer at `host`? A RobotError says what was tried if not."""
    question = pack(Kind.VERSION, struct.pack(">H", 2))
    try:
        with socket.create_connection((host, RTDE), PATIENCE) as link:
            link.sendall(question)
            packets, _ = split(link.recv(64))
    except OSError as e:
        raise RobotError(_silent(host, RTDE, e)) from e
    except WireError as e:
        raise RobotError(f"{host}:{RTDE} answers, but not as a UR does; check the address") from e
    if not packets or packets[0].payload != b"\x01":
        raise RobotError(f"{host}:{RTDE} speaks no RTDE 2; a UR needs Polyscope 3.5 or newer")


def dashboard(host: str, *lines: str) -> list[str]:
    """The dashboard's answers to `lines`; a RobotError when it does not answer."""
    try:
        with socket.create_connection((host, DASHBOARD), PATIENCE) as link:
            talk = link.makefile("rw", encoding="utf-8", errors="replace", newline="\n")
            talk.readline()  # its greeting
            answers = []
            for line in lines:
                talk.write(line + "\n")
                talk.flush()
                answers.append(talk.readline().strip())
            return answers
    except OSError as e:
        raise RobotError(_silent(host, DASHBOARD, e)) from e


def _silent(host: str, port: int, error: OSError) -> str:
    why = error.strerror or ("no answer" if isinstance(error, TimeoutError) else str(error))
    return (
        f"{host}:{port} does not answer ({why}); check the address, the cable, and that the "
        "controller is on"
    )
