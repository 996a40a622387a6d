"""May the arm move, and how fast? What the machine says and what people ask, weighed together.

Whatever casts doubt stops the arm, by name: its own report, its sensors' silence, a fault of
the machine that runs us. Late sensors slow it. Only a person sets a stopped arm going again,
and then it waits for frames that are measured from that moment on.

A sensor that cannot tell what is before it leaves space unseen. It is named, and the body is
carried into that space no faster than it can stop before it (`app.control.unseen`); where half of
the skin cannot tell, the arm stops.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.control.supervisor import Supervisor, speed_share
from app.control.unseen import NOTHING_UNSEEN, Unseen
from app.messages import Command, Mode, SensorFrame, Status, freeze
from app.perception.blindness import cones_of
from app.perception.health import SkinHealth
from app.perception.unable import SEEING, Unable
from app.robot.model import Robot
from app.robot.skin import Skin
from app.tick import Inputs

SILENT_SHARE = 0.5  # of the connected sensors: from this share on the arm is blind
SLOWS = 0.4  # of the silence that stops the arm: three frames at 15 Hz of half a second
BLIND_STOP = 0.5  # of what the connected sensors look into: from this share on the arm is blind
LONGER = 0.1  # [s] a sensor alone may be silent beyond what is borne of all: a frame and its way
NAMED = 3  # sensors in a sentence; a person looks up the rest on the page
# by `Unable`: do all of its zones tell, or some?  A table takes a tick a microsecond, not 50
TELLS, TELLS_PARTLY = np.zeros((2, len(Unable)), dtype=bool)
TELLS[[*SEEING]] = TELLS_PARTLY[[*SEEING, Unable.BAD_STATUS]] = True
STALL = 0.2  # [s] a tick later than this is a stall of this machine: three frames at 15 Hz
MOVES = {Mode.RUNNING, Mode.HOLDING}
NOT_SEEN = "waits for the first frames"


class Guard:
    """Holds the mode and what is known of the sensors, by name; `begin`: the mode to wake up in."""

    def __init__(self, robot: Robot, skin: Skin, begin: Mode) -> None:
        self.health = SkinHealth(skin, robot.supports[skin.link])
        self.unable: NDArray[np.uint8] = freeze(np.zeros(skin.count, dtype=np.uint8))  # `Unable`
        self.unseen = NOTHING_UNSEEN  # the space that is lost from sight
        self.blind_share = 0.0  # 0..1 of what the connected sensors look into
        self._skin, self._cones = skin, cones_of(skin)
        self._connected: NDArray[np.bool_] = np.zeros(skin.count, dtype=bool)
        self._turns = 0  # of the zones' losses that `unseen` knows of
        self._repeats = False  # does any sensor repeat what was?
        self._late = ""  # why the arm is slowed for late sensors
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
        self.health.update(x.frames, x.now, x.joints.q)
        wakes = self.mode is Mode.IDLE and self.health.heard_since(self._listening)
        if wakes:
            self._supervisor.ready(self._begin, x.now)
        return wakes

    def believed(self, frames: Sequence[SensorFrame]) -> Sequence[SensorFrame]:
        """Without those that repeat what was: an arm would give way to its own trace."""
        if not self._repeats:
            return frames
        return [f for f in frames if self.unable[f.sensor] != Unable.FROZEN]

    def ask(self, mode: Mode, reason: str, now: float) -> None:
        """A person asks for a mode."""
        if mode is not Mode.STOPPED and not {mode, self.mode} <= MOVES:
            self._listening = now  # an arm that goes on moving has fresh frames already
        self._supervisor.request(mode, reason, now)

    def fault(self, reason: str, now: float) -> None:
        """Stop; the first reason stays until a person acts."""
        self._supervisor.fault(reason, now)

    def judge(self, x: Inputs, silence: float, unable: NDArray[np.uint8]) -> tuple[float, bool]:
        """The share of the speed that may be used, and whether the arm may move at all.

        silence: [s] of half of the sensors that stops it; from `SLOWS` of it on it slows.
        unable:  (K,) of `Unable`, what the frames themselves tell.
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
        self._look(x.source.connected, self.health.unable(x.now, silence + LONGER, since), unable)
        if self.blind_share >= BLIND_STOP and self.mode is not Mode.IDLE:  # nor before they spoke
            count = int(np.count_nonzero(self._unseeing()))
            self.fault(f"{count} of {connected} sensors cannot see: {self._listed()}", x.now)
        share, slow_after, self._late = 1.0, SLOWS * silence, ""
        if self.health.silent(x.now, slow_after, since) >= SILENT_SHARE * max(connected, 1):
            age = self.health.age(x.now, since, SILENT_SHARE)
            share = speed_share(age, slow_after, silence)
            if share < 1.0:
                self._late = f"slow: the sensors are silent for {age:.1f} s"
        return share * x.arm.pace, self.mode in MOVES and x.arm.ready and self.health.heard_since(
            since
        )

    def advice(self, command: Command) -> str:
        """What a person should know of the sensors, and what it costs; empty if all can tell."""
        if self._late or not self._unseeing().any():
            return self._late
        cost = ""
        if command.unseen_of >= 0:
            name = self._skin.sensors[command.unseen_of].name
            cost = f"; {100.0 * command.unseen:.0f} % of the speed, towards what {name} should see"
        return f"cannot see with {self._listed()}{cost}"

    def _look(
        self, connected: NDArray[np.bool_], heard: NDArray[np.uint8], told: NDArray[np.uint8]
    ) -> None:
        """Find the unseen space anew where another sensor or zone cannot tell than before."""
        unable = np.where(heard == Unable.SEES, told, heard) * connected
        same = np.array_equal(unable, self.unable) and np.array_equal(connected, self._connected)
        if same and self._turns == self.health.turns:
            return
        self.unable, self._connected = freeze(unable), connected.copy()
        self._repeats = bool((unable == Unable.FROZEN).any())
        self._turns, owner = self.health.turns, self._skin.sensor_of
        lost = self.health.lost | ~TELLS_PARTLY[unable][owner]
        tell = self._cones.blocks(~lost & connected[owner])
        blind = ~tell & connected[self._cones.owner]
        self.blind_share = float(blind.sum() / max(connected[self._cones.owner].sum(), 1))
        self.unseen = Unseen(*self._cones.unseen(blind, tell))

    def _unseeing(self) -> NDArray[np.bool_]:
        """(K,) the sensors that cannot tell; a dirty window holds nothing back."""
        return ~TELLS[self.unable]

    def _listed(self) -> str:
        """The first sensors that cannot tell, by name, and why."""
        blind = np.flatnonzero(self._unseeing())
        words = [f"{self._skin.sensors[k].name} ({Unable(self.unable[k]).words})" for k in blind]
        return listed(words)


def listed(words: Sequence[str]) -> str:
    """The first of them, and how many more there are."""
    more = f" and {len(words) - NAMED} more" if len(words) > NAMED else ""
    return ", ".join(words[:NAMED]) + more
