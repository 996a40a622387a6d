"""Questions to a UR's dashboard, with short patience."""

import re
import socket

from app.errors import RobotError

DASHBOARD = 29999
PATIENCE = 1.0  # [s] for a connection, and for each answer


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
        raise RobotError(silent(host, DASHBOARD, e)) from e


def version_of(answer: str) -> tuple[int, ...]:
    """A controller's version out of "URSoftware 3.15.8.106339 (Jan 12 2023)"; empty without one."""
    found = re.search(r"(\d+)\.(\d+)", answer)
    return (int(found[1]), int(found[2])) if found else ()


def silent(host: str, port: int, error: OSError) -> str:
    """That nobody answers at a port, why, and what to look at."""
    why = error.strerror or ("no answer" if isinstance(error, TimeoutError) else str(error))
    return (
        f"{host}:{port} does not answer ({why}); check the address, the cable, and that the "
        "controller is on"
    )
