"""May the arm move, and how fast? What the machine says and what people ask, weighed together.

Whatever casts doubt stops the arm, by name: its own report, its sensors' silence, a fault of
the machine that runs us. Late sensors slow it. Only a person sets a stopped arm going again,
and then it waits for frames that are measured from that moment on.
"""

from collections.abc import Sequence

import numpy as np

from app.control.supervisor import Supervisor, speed_share
from app.messages import Mode, SensorHealth, Status
from app.perception.health import SkinHealth
from app.robot.skin import Skin
from app.tick import Inputs

SILENT_SHARE = 0.5  # of the connected sensors: from this share on the arm is blind
SLOWS = 0.4  # of the silence that stops the arm: three frames at 15 Hz of half a second
BLIND_STOP = 3  # sensors that cannot see; one or two of them slow the arm
LONGER = 0.1  # [s] a sensor alone may be silent beyond what is borne of all: a frame and its way
USELESS = {
    SensorHealth.POOR: "bad statuses", SensorHealth.SATURATED: "covered",
}  # fmt: skip
STALL = 0.2  # [s] a tick later than this is a stall of this machine: three frames at 15 Hz
NOT_SEEN = "waits for the first frames"


class Guard:
    """Holds the mode and what is known of the sensors, by name; `begin`: the mode to wake up in."""

    def __init__(self, skin: Skin, begin: Mode) -> None:
        self.health = SkinHealth(skin)
        self.blind_share = 0.0  # 0..1 of the connected sensors
        self._names = tuple(s.name for s in skin.sensors)
        self.advice = ""  # why the arm is slowed; empty while it is not
        self._begin = begin
        self._supervisor = Supervisor(Mode.IDLE, 0.0, NOT_SEEN)
        self._listening: float | None = None  # [s] silence is counted from here

    @property
    def status(self) -> Status:
        """The mode, why, and since when."""
        return self._supervisor.status

    @property
    def mode(self) -> Mode:
        """What the arm may do now."""
        return self._supervisor.mode

    def listen(self, x: Inputs) -> bool:
        """Take note of the sensors; True when they have spoken for the first time."""
        if self._listening is None and self.mode is Mode.IDLE:
            self._supervisor = Supervisor(Mode.IDLE, x.now, NOT_SEEN)
        if self._listening is None or x.late > STALL:
            # a stall was this machine's, not the sensors'; wait for fresh frames, though
            self._listening = x.now
        self.health.connect(x.source.connected)
        self.health.update(x.frames, x.now)
        wakes = self.mode is Mode.IDLE and self.health.heard_since(self._listening)
        if wakes:
            self._supervisor.ready(self._begin, x.now)
        return wakes

    def ask(self, mode: Mode, reason: str, now: float) -> None:
        """A person asks for a mode."""
        if mode is not Mode.STOPPED:
            self._listening = now
        self._supervisor.request(mode, reason, now)

    def fault(self, reason: str, now: float) -> None:
        """Stop; the first reason stays until a person acts."""
        self._supervisor.fault(reason, now)

    def judge(self, x: Inputs, silence: float) -> tuple[float, bool]:
        """The share of the speed that may be used, and whether the arm may move at all.

        silence: [s] of half of the sensors that stop it; from `SLOWS` of it on it slows.
        """
        since = self._listening
        assert since is not None  # `listen` has been here
        for reason in (x.fault, x.arm.fault, x.source.ended, x.source.fault):
            if reason:
                self.fault(reason, x.now)
        connected = int(x.source.connected.sum())
        silent = self.health.silent(x.now, silence, since)
        if connected and silent >= SILENT_SHARE * connected:
            self.fault(f"{silent} of {connected} sensors silent for more than {silence:g} s", x.now)
        blind = self._blind(x, silence, since)
        share, age = max(1.0 - len(blind) / BLIND_STOP, 0.0), 0.0
        if len(blind) >= BLIND_STOP:
            self.fault(f"{len(blind)} of {connected} sensors cannot see: {_listed(blind)}", x.now)
        self.blind_share = len(blind) / max(connected, 1)
        self.advice = f"slow: cannot see with {_listed(blind)}" if blind else ""
        slow_after = SLOWS * silence
        if self.health.silent(x.now, slow_after, since) >= SILENT_SHARE * max(connected, 1):
            age = self.health.age(x.now, since, SILENT_SHARE)
            share *= (late := speed_share(age, slow_after, silence))
            if late < 1.0:
                self.advice = f"slow: the sensors are silent for {age:.1f} s"
        moves = self.mode in (Mode.RUNNING, Mode.HOLDING)
        return share * x.arm.pace, moves and x.arm.ready and self.health.heard_since(since)

    def _blind(self, x: Inputs, silence: float, since: float) -> list[str]:
        """The connected sensors that cannot tell what is before them, each with its reason."""
        quiet = self.health.quiet(x.now, silence + LONGER, since)
        state = self.health.states(x.now, with_age=False)
        blind = []
        for k in np.flatnonzero(quiet | np.isin(state, list(USELESS))):
            why = "silent" if quiet[k] else USELESS[SensorHealth(state[k])]
            blind.append(f"{self._names[k]} ({why})")
        return blind


def _listed(blind: Sequence[str]) -> str:
    """The first of them by name; a person looks up the rest on the page."""
    more = f" and {len(blind) - BLIND_STOP} more" if len(blind) > BLIND_STOP else ""
    return ", ".join(blind[:BLIND_STOP]) + more
