"""May the arm move? A small state machine; every change has a reason that a person can read.

A fault stops the arm. Only a person sets it going again: `request(RUNNING)` or HOLDING.
"""

from app.messages import Mode, Status


class Supervisor:
    """Holds the present status; `request` is a person's word, `fault` the machine's."""

    def __init__(self, mode: Mode, now: float) -> None:
        self.status = Status(mode, "started", now)

    def request(self, mode: Mode, reason: str, now: float) -> None:
        """A person asks for a mode; always granted, a lasting fault stops it again."""
        if mode is not self.status.mode or reason != self.status.reason:
            self.status = Status(mode, reason, now)

    def fault(self, reason: str, now: float) -> None:
        """Stop for `reason`; the first reason stays until a person acts."""
        if self.status.mode is not Mode.STOPPED:
            self.status = Status(Mode.STOPPED, reason, now)

    @property
    def mode(self) -> Mode:
        """What the arm may do now."""
        return self.status.mode
