"""Joint states of a UR as they come in, and the link begun anew when it is lost.

The control thread reads what has come in its own tick and never waits. Beginning anew, which
takes as long as the other side likes, is left to a thread; so is reading while nobody ticks,
since a controller sends clients away that do not listen.
"""

import threading

import numpy as np

from app.errors import RobotError
from app.messages import JointState
from app.robot.ur.clock import ControllerClock
from app.robot.ur.link import Link
from app.robot.ur.safety import Report

STALE = 0.1  # [s] 50 states of an e-Series
ROUND = 0.5  # [s] between two looks at the link
SILENT = 4  # rounds without a state until the link is begun anew, though it seems to stand


class Stream:
    """The newest joint state of `host`; a RobotError when none comes at the first try."""

    def __init__(self, host: str) -> None:
        self._host = host
        self._link = Link(host)
        self._clock = ControllerClock()
        self._theirs = -np.inf  # [s] the newest timestamp of theirs
        self._fresh = -np.inf  # [s] when it changed, on our clock
        first = self._link.newest
        self.last = JointState(0.0, first.q, first.qd)
        self._reading = threading.Lock()  # held for one read
        self._ticked = False  # has somebody asked since the last round?
        self._quit = threading.Event()
        self._thread = threading.Thread(target=self._mend, name="ur-stream", daemon=True)
        self._thread.start()

    def state(self, now: float) -> JointState:
        """The newest joint state; the last one that came when the link is lost."""
        self._ticked = True
        if self._reading.acquire(blocking=False):
            try:
                self._link.drain()
            finally:
                self._reading.release()
        sample = self._link.newest
        if sample.timestamp != self._theirs:
            self._theirs, self._fresh = sample.timestamp, now
            self.last = JointState(self._clock.stamp(sample.timestamp, now), sample.q, sample.qd)
        return self.last

    @property
    def fault(self) -> str:
        """Why the link brings nothing more; empty while it stands."""
        return self._link.fault

    def lost(self, now: float) -> str:
        """Why there is no state that is fresh at `now` [s]; empty when there is one."""
        if self.fault or now - self._fresh <= STALE:
            return self.fault
        return f"no joint state for more than {STALE:g} s; check the cable and the controller"

    @property
    def major(self) -> int:
        """Of the controller's version: 3 CB3, 5 e-Series, 10 PolyScope X."""
        return self._link.major

    def report(self) -> Report:
        """The controller's own state as it came last."""
        return self._link.newest.report

    def close(self) -> None:
        """End the stream and its thread."""
        self._quit.set()
        self._thread.join()
        self._link.close()

    def _mend(self) -> None:
        seen, silent = 0, 0
        while not self._quit.wait(ROUND):
            if not self._ticked:
                with self._reading:
                    self._link.drain()
            self._ticked = False
            silent = silent + 1 if self._link.count == seen else 0
            seen = self._link.count
            if self.fault or silent >= SILENT:
                self._renew()
                seen, silent = 0, 0

    def _renew(self) -> None:
        try:
            fresh = Link(self._host)
        except RobotError:
            return  # `lost` tells of it all the while
        with self._reading:
            self._link, old = fresh, self._link
        old.close()
