"""Simulated frames from a process of their own.

Hundreds of rays a frame are no work for the control thread: a frame is due 50 ms after it was
measured, a tick at once. So the thread only says who is to measure, and where the arm is; the
other process (`app.sensing.simulation`) answers with frames, bit for bit those of a
`SimulatedSkin`. When it falls behind, frames come later with the time they were measured at, as
those of a slow sensor do. The control thread never waits for it, nor gives the interpreter's
lock away for it while no one edits the world.
"""

import os
import pickle
import socket
import subprocess
import sys
import time
from collections import deque
from mmap import mmap

import numpy as np
from numpy.typing import NDArray

from app.errors import SensorError
from app.messages import SensorFrame
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.budget import IDEAL, Budget
from app.sensing.error_model import ErrorModel
from app.sensing.schedule import EARLY, LATENCY, Schedule
from app.sensing.sight import eyes_of
from app.sensing.simulation import Task, size_of
from app.sensing.stamps import Stamps
from app.sensing.traffic import Request, Traffic
from app.sensing.truth import draw_truth
from app.world.world import Edit, World

PROCESS = "app.sensing.simulation"
BEGIN = 120.0  # [s] until the process must be ready; it may have to compile
END = 5.0  # [s] until it must have ended
CHECK = 0.1  # [s] between two looks whether it lives, made only while an answer is late


class SimulatedSkinApart:
    """A `SimulatedSkin` whose frames are computed in another process; its arguments are the same.

    The process starts with a copy of `world` as it is now, and follows every edit of it. Until it
    is ready no sensor speaks; `wait` for it before time matters.
    """

    def __init__(
        self,
        robot: Robot,
        skin: Skin,
        world: World,
        seed: int = 0,
        errors: ErrorModel | None = None,
        latency: float = LATENCY,
        budget: Budget = IDEAL,
    ) -> None:
        self.truth = draw_truth(robot, skin, budget, seed)
        self.name = "simulated"
        self.connected: NDArray[np.bool_] = np.ones(skin.count, dtype=bool)
        self.muted: set[int] = set()  # sensors that have gone silent, for trying faults
        self._world, self._stamps = world, Stamps(self.truth, latency)
        self._schedule = Schedule([s.type.period for s in skin.sensors])
        self._edits: list[Edit] = []  # not yet told
        self._edited = 0  # how many there were so far
        self._letters = bytearray()  # about edits, that the line has not yet taken
        self._asked: deque[float] = deque()  # times of the requests without an answer
        self._held: SensorFrame | None = None  # has come before its time
        self._checked = -np.inf
        self._fault = ""
        errors = errors or ErrorModel()
        task = Task(eyes_of(self.truth), world, seed, errors, self._stamps.delay)
        self._process, self._line, memory = _start(task)
        self._traffic = Traffic(memory, size_of(task))
        world.follow(self._note_edit)

    def wait(self, seconds: float = BEGIN) -> None:
        """Wait until the process is ready; raises SensorError, in words, if it is not in time."""
        end = time.monotonic() + seconds
        while not self._traffic.ready:
            self._check_process()
            if not self._fault and time.monotonic() > end:
                self._fault = f"the simulation was not ready in {seconds:g} s; start again"
            if self._fault:
                raise SensorError(self._fault)
            time.sleep(0.01)

    @property
    def unanswered(self) -> int:
        """Requests that the process has not yet answered."""
        return self._traffic.requests.waiting

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Have the sensors measure that are due, return the frames that have arrived."""
        self._request_frames(now, posture)
        late = self._asked and now - self._asked[0] > CHECK
        if (late or not self._traffic.ready) and now - self._checked > CHECK:
            self._checked = now
            self._check_process()
        return self._arrived_frames(now)

    def ended(self) -> str:
        """A simulation never ends by itself."""
        return ""

    def fault(self, now: float, silence: float, used: NDArray[np.bool_]) -> str:
        """Why no frame will come any more, for whoever relies on one."""
        return self._fault if used.any() else ""

    def inputs(self, now: float) -> tuple[tuple[str, str], ...]:
        """How far the process is behind."""
        late = now - self._asked[0] - self._stamps.delay if self._asked else 0.0
        words = f"{1e3 * late:.0f} ms behind" if late > 0.0 else "in time"
        ready = "in a process of its own, " + words if self._traffic.ready else "begins"
        return (("simulation", self._fault or ready),)

    def close(self) -> None:
        """Have the process end; returns when it is gone."""
        self._line.close()
        try:
            self._process.wait(END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    # --- to the process -------------------------------------------------------------------

    def _request_frames(self, now: float, posture: Posture) -> None:
        requests = self._traffic.requests
        for _ in range(len(self._asked) - requests.waiting):
            self._asked.popleft()
        if self._fault or not self._traffic.ready or requests.full:
            return  # whoever is due now is so in the next tick
        due = [k for k in self._schedule.due(now) if k not in self.muted]
        if due:
            if self._edits or self._letters:
                self._send_edits()
            request = Request(now, self._world.time, self._edited, due, posture.T_base_link)
            self._traffic.put_request(request)
            self._asked.append(now)

    def _note_edit(self, edit: Edit) -> None:
        self._edits.append(edit)
        self._edited += 1

    def _send_edits(self) -> None:
        """Send what was edited, as far as the line takes it; the rest goes with what follows."""
        for edit in self._edits:
            self._letters += pickle.dumps(edit)
        self._edits.clear()
        try:
            del self._letters[: self._line.send(self._letters)]
        except BlockingIOError:
            pass
        except OSError:
            self._check_process()

    # --- from it --------------------------------------------------------------------------

    def _arrived_frames(self, now: float) -> list[SensorFrame]:
        arrived = []
        while frame := self._held or self._traffic.take_frame():
            early = frame.stamp + self._stamps.delay > now + EARLY
            self._held = frame if early else None
            if early:
                break
            arrived.append(self._stamps.stamped(frame))
        return arrived

    def _check_process(self) -> None:
        """Is the process alive? If not, what has it said?"""
        code = self._process.poll()
        if code is None or self._fault:
            return
        try:
            said = self._line.recv(4096).decode(errors="replace")
        except OSError:
            said = ""
        self._fault = f"the simulation has ended ({said or f'exit code {code}'}); start again"


def _start(task: Task) -> tuple[subprocess.Popen[bytes], socket.socket, memoryview]:
    """The process, the line to it, and the memory that is shared with it."""
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    with (
        theirs,
        os.fdopen(os.memfd_create("flinch-traffic"), "r+b") as shared,
        os.fdopen(os.memfd_create("flinch-task"), "r+b") as letter,
    ):
        shared.truncate(Traffic.room(size_of(task)))
        pickle.dump(task, letter)
        letter.seek(0)
        fds = (theirs.fileno(), shared.fileno(), letter.fileno())
        try:
            process = subprocess.Popen(
                # -P: a folder `app` where we stand is not ours
                [sys.executable, "-P", "-m", PROCESS, *map(str, fds)],
                pass_fds=fds,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,  # ours may be a --json
                start_new_session=True,  # a Ctrl-C is for us
            )
        except OSError as e:
            ours.close()
            raise SensorError(f"the simulation's process cannot begin ({e}); free memory") from e
        return process, ours, memoryview(mmap(shared.fileno(), 0))
