"""May the arm move, and how fast? A pure state machine; every change has a reason to read.

    idle ──ready──► running ◄──ask──► holding        a person's ask is granted in every state
      └────────── fault, ask ──► stopped ──ask──► running, holding

A fault stops the arm. Only a person sets it going again. Before the sensors fall silent for
good they are late: then the arm slows, and is its old self when they speak again.
"""

from dataclasses import dataclass

from app.messages import Mode, Status


@dataclass(frozen=True, slots=True)
class Ready:
    """The sensors have spoken for the first time; an idle arm goes to this mode."""

    mode: Mode = Mode.RUNNING


@dataclass(frozen=True, slots=True)
class Ask:
    """A person, or a program that a person has started, asks for a mode."""

    mode: Mode
    reason: str


@dataclass(frozen=True, slots=True)
class Fault:
    """The machine has a reason to stop."""

    reason: str


Event = Ready | Ask | Fault


def after(status: Status, event: Event, now: float) -> Status:
    """The status once `event` has happened at `now` [s]; the same object if nothing changes."""
    match event:
        case Ready(mode=mode) if status.mode is Mode.IDLE:
            return Status(mode, "started", now)
        case Ask(mode=mode, reason=reason) if (mode, reason) != (status.mode, status.reason):
            return Status(mode, reason, now)
        case Fault(reason=reason) if status.mode is not Mode.STOPPED:
            return Status(Mode.STOPPED, reason, now)  # the first reason stays until a person acts
    return status


def speed_share(age: float, slow_after: float, stop_after: float) -> float:
    """0..1 of the allowed speed when the sensors have been silent for `age` [s].

    It falls linearly from 1 at `slow_after` to 0 at `stop_after` [s].
    """
    if age >= stop_after:
        return 0.0
    if age <= slow_after:
        return 1.0
    return (stop_after - age) / (stop_after - slow_after)


class Supervisor:
    """Holds the present status and hands it from event to event."""

    def __init__(self, mode: Mode, now: float, reason: str = "started") -> None:
        self.status = Status(mode, reason, now)

    def ready(self, mode: Mode, now: float) -> None:
        """The sensors speak: an idle arm begins, in `mode`."""
        self.status = after(self.status, Ready(mode), now)

    def request(self, mode: Mode, reason: str, now: float) -> None:
        """A person asks for a mode; always granted, a lasting fault stops it again."""
        self.status = after(self.status, Ask(mode, reason), now)

    def fault(self, reason: str, now: float) -> None:
        """Stop for `reason`; the first reason stays until a person acts."""
        self.status = after(self.status, Fault(reason), now)

    @property
    def mode(self) -> Mode:
        """What the arm may do now."""
        return self.status.mode
