"""The driver: a UR as an arm of the engine.

    states  ◄── stream.py  ◄── link.py ◄── RTDE: position, time and state of one packet
    report  ◄── what the robot says of itself, in words
    send    ──► apart.py ──► client.py ──► control.py ──► the control program, only with `armed`
                            (a process)

Without `armed` nothing is ever sent, and the maker's client is not needed. After whatever
stopped the arm, it is looked after again by itself, but commands go out again only when a person
has asked for motion (`engage`).

Receiving and commanding fail apart. Garbled states are a fault here; the client is alive, brakes
the arm and ends its program. A client that dies or hangs takes the commands with it; the
controller's watchdog stops the arm, and states go on coming in. No call here waits for another
machine or process, but for the constructor, which has deadlines, and `close`.
"""

import re
import threading
from importlib.util import find_spec

import numpy as np

from app.errors import RobotError
from app.messages import Array, JointState
from app.robot.model import Robot
from app.robot.ur.apart import ControlApart
from app.robot.ur.limits import LIMITS, pace, slowed
from app.robot.ur.link import LOST, POLYSCOPE_X
from app.robot.ur.safety import trouble
from app.robot.ur.stream import Stream
from app.tick import ArmReport

JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
    "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
)  # fmt: skip
IDLE = "no control program runs; press Run to begin it"


class UrArm:
    """The arm at `host`, watched and, when `armed`, moved; raises RobotError when it is not there
    or not ready. `limits` are its own caps: whoever plans within them is never cut short."""

    limits = LIMITS

    def __init__(self, host: str, robot: Robot, *, armed: bool = False) -> None:
        if robot.joints != JOINTS:
            raise RobotError(
                f"--driver ur:{host} needs a UR's six joints; {robot.name} has "
                f"{', '.join(robot.joints)}"
            )
        if armed and find_spec("rtde_control") is None:
            raise RobotError("--arm needs ur-rtde, which is missing here; install flinch[ur]")
        self._host, self._armed = host, armed
        known = re.fullmatch(r"(ur\d+)e?", robot.name)  # the dashboard names no series
        self._model = known[1].upper() if known else ""
        self._control: ControlApart | None = None
        self._refused = ""  # why no control program runs
        self._beginning: threading.Thread | None = None
        self._leaving: threading.Thread | None = None
        self._quit = threading.Event()
        self._now = 0.0  # [s] of the last report
        self._ready = False
        self._stream = Stream(host)
        if armed:
            try:
                self._begin()
            except RobotError:
                self._stream.close()
                raise

    def state(self, now: float) -> JointState:
        """The newest joint state, stamped on our clock; the last one when the stream is lost."""
        return self._stream.state(now)

    def report(self, now: float) -> ArmReport:
        """Why the arm must stop or waits; commands go out only after one without a fault.

        `pace` is the pendant's speed slider, times a share in reduced mode. The controller
        itself slows what it is sent by its slider as well, so an arm with a slider below 100 %
        never moves faster than it was planned to, and may move slower.
        """
        self._now = now
        said = self._stream.report()
        why = self._stream.lost(now) or trouble(said) or self._idle(now)
        if why:
            self._abandon()
            fault = f"{self._host}: {why}"
            self._ready = False
            return ArmReport(fault=fault, ready=False, pace=pace(said))
        advice, begins = slowed(said), self._begins
        self._ready = self._armed and not begins
        if not self._armed:
            advice = f"monitoring only: nothing is sent to {self._host} (see --arm)"
        elif begins:
            advice = f"{self._host}: the control program begins"
        return ArmReport(advice=advice, ready=not begins, pace=pace(said))

    def send(self, qd: Array, dt: float) -> Array:
        """Ask for `qd` (6,) [rad/s] where that is allowed; returns what is `applied` by now, so as
        a rule the velocity before `qd`: nobody waits for the client here."""
        if not np.isfinite(qd).all():
            raise ValueError("a command with a non-finite joint velocity")
        if self._control is not None and self._ready:
            self._control.send(qd, self._stream.last.qd, dt, self._now)
        return self.applied(self._now)

    def applied(self, now: float) -> Array:
        """What really went out (6,) [rad/s]: the newest velocity that the client is known to have
        written to the controller. A tick after `send` it is, as a rule, what was asked for then.

        It is zero when none was written for as long as the controller's watchdog is patient, when
        no program runs, in a safety stop, when the arm is only watched; and at rest, when the
        watchdog alone is fed. It is less than was asked for where that was beyond `limits`.
        """
        control = self._control
        return control.sent(now) if control is not None and self._ready else np.zeros(6)

    def engage(self) -> None:
        """A person asks for motion: begin the control program if it has ended; returns at once."""
        if self._armed and self._control is None and not self._begins:
            self._beginning = threading.Thread(
                target=self._begin_later, name="ur-engage", daemon=True
            )
            self._beginning.start()

    def close(self) -> None:
        """Brake to rest, end the control program, leave."""
        self._quit.set()
        for thread in (self._beginning, self._leaving):
            if thread is not None:
                thread.join()
        if self._control is not None:
            self._control.close()
            self._control = None
        self._stream.close()

    @property
    def _begins(self) -> bool:
        """Does the control program begin?"""
        return self._beginning is not None and self._beginning.is_alive()

    def _idle(self, now: float) -> str:
        """Why no command reaches an arm that could move; empty when it does, or need not."""
        if not self._armed or self._begins:
            return ""
        control = self._control
        why = control.trouble(now) if control is not None else self._refused or IDLE
        self._refused = "" if why == LOST else why  # the link comes back, the program does not
        return why

    def _begin(self) -> None:
        why = self._stream.fault or trouble(self._stream.report())
        if why:
            raise RobotError(f"{self._host}: {why}")
        if self._stream.major >= POLYSCOPE_X:
            raise RobotError(
                f"{self._host} is a PolyScope X controller, which has no dashboard to ask whether "
                "it may be moved: it can be watched, so leave --arm out, but not moved"
            )
        self._control = ControlApart(self._host, self._model, self._quit)

    def _begin_later(self) -> None:
        self._refused = ""
        if self._leaving is not None:
            self._leaving.join()  # two clients would fight for the same registers
        try:
            self._begin()
        except RobotError as error:
            self._refused = str(error).removeprefix(f"{self._host}: ")

    def _abandon(self) -> None:
        """Send nothing more: the arm is stopped by itself, or its watchdog stops it."""
        if self._control is not None:
            self._leaving = threading.Thread(
                target=self._control.close, name="ur-leave", daemon=True
            )
            self._control = None
            self._leaving.start()
