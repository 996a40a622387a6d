"""The driver: a UR as an arm of the engine.

    states  ◄── stream.py  ◄── RTDE
    report  ◄── what the robot says of itself, in words
    send    ──► apart.py ──► control.py ──► the control program, only with `armed`

Without `armed` nothing is ever sent. After whatever stopped the arm, it is looked after again
by itself, but commands go out again only when a person has asked for motion (`engage`).
"""

import re
import threading

import numpy as np

from app.errors import RobotError
from app.messages import Array, JointState
from app.robot.model import Robot
from app.robot.ur.apart import ControlApart
from app.robot.ur.safety import trouble
from app.robot.ur.stream import LOST, Stream
from app.tick import ArmReport

JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
    "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
)  # fmt: skip
IDLE = "no control program runs; press Run to begin it"


class UrArm:
    """The arm at `host`, watched and, when `armed`, moved; raises RobotError when it is not there
    or not ready."""

    def __init__(self, host: str, robot: Robot, *, armed: bool = False) -> None:
        if robot.joints != JOINTS:
            raise RobotError(
                f"--driver ur:{host} needs a UR's six joints; {robot.name} has "
                f"{', '.join(robot.joints)}"
            )
        self._host, self._armed = host, armed
        known = re.fullmatch(r"(ur\d+)e?", robot.name)  # the dashboard names no series
        self._model = known[1].upper() if known else ""
        self._control: ControlApart | None = None
        self._refused = ""  # why no control program runs
        self._beginning: threading.Thread | None = None
        self._leaving: threading.Thread | None = None
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
        """Why the arm must stop or waits; commands go out only after one without a fault."""
        self._ready = False
        lost = self._stream.lost(now)
        why = lost or trouble(self._stream.report())
        if why:
            self._abandon()
            return ArmReport(fault=f"{self._host}: {why}", ready=False)
        if not self._armed:
            return ArmReport(advice=f"monitoring only: nothing is sent to {self._host} (see --arm)")
        if self._beginning is not None and self._beginning.is_alive():
            return ArmReport(advice=f"{self._host}: the control program begins", ready=False)
        why = self._control.trouble if self._control is not None else self._refused or IDLE
        if why:
            self._refused = "" if why == LOST else why  # the link comes back, the program does not
            self._abandon()
            return ArmReport(fault=f"{self._host}: {why}", ready=False)
        self._ready = True
        return ArmReport()

    def send(self, qd: Array, dt: float) -> Array:
        """Ask for `qd` (6,) [rad/s] where that is allowed; returns what was really sent."""
        if not np.isfinite(qd).all():
            raise ValueError("a command with a non-finite joint velocity")
        if self._control is None or not self._ready:
            return np.zeros(6)
        return self._control.send(qd, self._stream.last.qd, dt)

    def engage(self) -> None:
        """A person asks for motion: begin the control program if it has ended."""
        busy = self._beginning is not None and self._beginning.is_alive()
        if self._armed and self._control is None and not busy:
            self._beginning = threading.Thread(
                target=self._begin_later, name="ur-engage", daemon=True
            )
            self._beginning.start()

    def close(self) -> None:
        """Brake to rest, end the control program, leave."""
        for thread in (self._beginning, self._leaving):
            if thread is not None:
                thread.join()
        if self._control is not None:
            self._control.close()
            self._control = None
        self._stream.close()

    def _begin(self) -> None:
        why = trouble(self._stream.report())
        if why:
            raise RobotError(f"{self._host}: {why}")
        self._control = ControlApart(self._host, self._model)

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
