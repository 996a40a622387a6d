"""Joint states of a UR as they come in, and the stream begun anew when it is lost."""

import threading

import numpy as np
from rtde_receive import RTDEReceiveInterface

from app.errors import RobotError
from app.messages import JointState, freeze
from app.robot.ur.clock import ControllerClock
from app.robot.ur.probe import probe
from app.robot.ur.safety import Report

STALE = 0.1  # [s] 50 states of an e-Series
LOST = "the connection is lost; check the cable and the controller"
FIRST, TRIES = 1.0, 50  # [s] until the first state must be there, and looks for it
RETRY = 1.0  # [s] between two tries to begin anew
VARIABLES = [
    "timestamp", "actual_q", "actual_qd", "robot_mode", "safety_mode", "robot_status_bits",
    "runtime_state",
]  # fmt: skip


class Stream:
    """The newest joint state of `host`; a thread of its own begins anew when it is lost.

    Raises RobotError when nobody answers at the first try.
    """

    def __init__(self, host: str) -> None:
        self._host = host
        self._clock = ControllerClock()
        self._theirs = -1.0  # the newest timestamp of theirs
        self._fresh = -np.inf  # when it changed, on our clock
        self._receive = self._open()
        self.last = JointState(0.0, freeze(np.zeros(6)), freeze(np.zeros(6)))
        self._quit = threading.Event()
        self._thread = threading.Thread(target=self._mend, name="ur-stream", daemon=True)
        self._thread.start()

    def state(self, now: float) -> JointState:
        """The newest joint state; the last one that came when the stream is lost."""
        receive = self._receive
        theirs = receive.getTimestamp()
        if theirs != self._theirs:
            self._theirs, self._fresh = theirs, now
            q, qd = np.array(receive.getActualQ()), np.array(receive.getActualQd())
            self.last = JointState(self._clock.stamp(theirs, now), freeze(q), freeze(qd))
        return self.last

    def lost(self, now: float) -> str:
        """Why there is no state that is fresh at `now` [s]; empty when there is one."""
        if not self._receive.isConnected():
            return LOST
        if now - self._fresh <= STALE:
            return ""
        return f"no joint state for more than {STALE:g} s; check the cable and the controller"

    def report(self) -> Report:
        """The controller's own state as it came last."""
        r = self._receive
        return Report(r.getRobotMode(), r.getSafetyMode(), r.getRobotStatus(), r.getRuntimeState())

    def close(self) -> None:
        """End the stream and its thread."""
        self._quit.set()
        self._thread.join()
        self._receive.disconnect()

    def _open(self) -> RTDEReceiveInterface:
        probe(self._host)
        try:
            receive = RTDEReceiveInterface(self._host, -1.0, VARIABLES)
        except RuntimeError as e:
            words = " ".join(str(e).split())
            raise RobotError(f"{self._host}: joint states are refused ({words})") from e
        pause = threading.Event()
        for _ in range(TRIES):
            if len(receive.getActualQ()) == 6 and receive.getTimestamp() > 0.0:
                return receive
            pause.wait(FIRST / TRIES)
        receive.disconnect()
        raise RobotError(f"{self._host} accepts the connection but sends no joint states")

    def _mend(self) -> None:
        while not self._quit.wait(RETRY):
            if self._receive.isConnected():
                continue
            try:
                fresh = self._open()
            except RobotError:
                continue  # `lost` tells it all the while
            self._receive.disconnect()
            self._receive = fresh
