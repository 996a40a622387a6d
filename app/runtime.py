"""The engine: one paced thread between a plant and a brain.

    actions ─► plant.read ─► Inputs ─► brain ─► Outputs ─► plant.send
                                └──────────────────┴─► Latest[Snapshot], subscribers

It paces, drains actions and hands on; it decides nothing. What fails outside the brain becomes
a fault in the next Inputs, so that the brain stops the arm and says why.
"""

import gc
import logging
import queue
import sys
import threading
from dataclasses import replace

import numpy as np

from app.actions import OF_THE_PLANT, Action, Remark
from app.brain import Brain
from app.compiled import Progress
from app.errors import FlinchError
from app.ghost import Ghost
from app.messages import Mode, Snapshot, Status, Timing
from app.plant.plant import Plant, Reading, nothing_read, refusal
from app.rehearsal import rehearse, silent
from app.tick import Follower, Inputs, Outputs, Tick, snapshot_of
from app.timing import (
    Clock,
    Latest,
    Stopwatch,
    Subscription,
    Ticker,
    prefer_this_thread,
)  # fmt: skip

log = logging.getLogger(__name__)
SWITCH = 1e-3  # [s] the control thread waits no longer for another one; 5 ms is a whole tick


class Engine:
    """Runs `brain` on `plant`. `step` is one tick; `start` runs it in a thread."""

    def __init__(
        self, brain: Brain, plant: Plant, clock: Clock, *, rate: float = 250.0, scene: str = ""
    ) -> None:
        self.brain, self.plant, self.scene = brain, plant, scene
        self.robot, self.skin, self.cell = brain.robot, brain.skin, brain.cell
        self.editable = plant.editable
        self.source, self.programs = plant.name, tuple(brain.wishes.errand.programs)
        self.snapshots: Latest[Snapshot] = Latest()
        self.ticker = Ticker(clock, 1.0 / rate)
        self.ghost: Ghost | None = None
        self.progress: Progress = silent  # told of each kernel that `start` has to compile
        self.warnings: tuple[str, ...] = ()  # what a person should know before it starts
        self._clock, self._period = clock, 1.0 / rate
        self._actions: queue.SimpleQueue[Action] = queue.SimpleQueue()
        self._followers: tuple[Follower, ...] = ()
        self._trace = self._fault = ""  # of the last tick; what failed in this machine since
        self._last: Reading | None = None
        self._stamp: float | None = None  # [s] of the last tick
        self._tick = 0
        self._thread: threading.Thread | None = None
        self._preferred = False  # by the system, before ordinary threads
        self._quit = threading.Event()

    def post(self, action: Action) -> None:
        """Queue an action for the head of the next tick; thread-safe, returns at once."""
        self._actions.put(action)

    def subscribe(self, room: int) -> Subscription[Tick]:
        """Every tick's Inputs and Outputs from now on; at most `room` of them wait."""
        new: Subscription[Tick] = Subscription(room)
        self.follow(new)
        return new

    def follow(self, follower: Follower) -> None:
        """Hand every tick from now on to `follower`, which must not take long."""
        self._followers = (*self._followers, follower)

    def unfollow(self, follower: Follower) -> None:
        """Hand it no more ticks, but perhaps the one that is under way; it is not closed."""
        self._followers = tuple(f for f in self._followers if f is not follower)

    # --- one tick -------------------------------------------------------------------------

    def step(self) -> Snapshot:
        """One tick at the clock's time."""
        late = self.ticker.wait()
        now = self._clock.now()
        elapsed = self._period if self._stamp is None else now - self._stamp
        dt = min(max(elapsed, 0.1 * self._period), 5.0 * self._period)
        self._stamp = now
        watch = Stopwatch()
        actions, refused = self._drain()
        reading = self._read(now)
        watch.lap("simulate")
        x = Inputs(
            self._tick, now, dt, late, reading.joints, reading.applied, reading.arm, reading.frames,
            reading.source, actions, refused, self._fault,
        )  # fmt: skip
        self._fault = ""
        out = self.brain.tick(x, watch.lap)
        trace = out.trace or x.source.trace
        if trace and trace != self._trace:  # each once: what lasts is told in the status
            log.error("tick %d failed; the arm stops\n%s", self._tick, trace)
        self._trace = trace
        self._send(out, dt)
        watch.lap("drive")
        ghost = self.ghost.step(x, out) if self.ghost else None
        if self.ghost:
            watch.lap("ghost")
            if self.ghost.fault:
                self.post(Remark(f"the ghost is left out: {self.ghost.fault}", refused=True))
                self.ghost = None
        timing = Timing(watch.laps, late, self._preferred, 1.0 / self._period)
        snapshot = snapshot_of(x, out, timing, self.plant.bodies(), ghost)
        self.snapshots.put(snapshot, now)
        for follower in self._followers:
            follower.put((x, out))
        self._tick += 1
        return snapshot

    def _drain(self) -> tuple[tuple[Action, ...], str]:
        """What people asked for, in their order, and why the plant did not do the last of it."""
        actions: list[Action] = []
        refused = ""
        while True:
            try:
                action = self._actions.get_nowait()
            except queue.Empty:
                return tuple(actions), refused
            actions.append(action)
            refused = refusal(self.plant, action) if isinstance(action, OF_THE_PLANT) else ""

    def _read(self, now: float) -> Reading:
        try:
            self._last = self.plant.read(now, self.brain.params.silence)
        except Exception as error:
            self._fail("the plant cannot be read", error)
            last = self._last or nothing_read(self.robot.n, self.skin.count, now)
            self._last = replace(last, joints=replace(last.joints, stamp=now), frames=())
        return self._last

    def _send(self, out: Outputs, dt: float) -> None:
        try:
            if out.engage:
                self.plant.engage()
            self.plant.send(out.command.qd, dt)
        except Exception as error:
            self._fail("the arm takes no command", error)

    def _fail(self, what: str, error: Exception) -> None:
        """The next Inputs have a fault; its trace is logged once while it lasts."""
        last, _ = self.snapshots.get()
        if last is None or last.status.mode is not Mode.STOPPED:
            log.error("%s", what, exc_info=error)
        self._fault = str(error) if isinstance(error, FlinchError) else f"{what}: {error!r}"

    # --- the thread -----------------------------------------------------------------------

    def start(self) -> None:
        """Run ticks in a thread of their own until `stop`; may be started again after it."""
        if self._thread is not None:
            raise RuntimeError("the engine runs already")
        sys.setswitchinterval(SWITCH)
        brain = self.brain
        rehearse(brain.robot, brain.skin, brain.cell, brain.params, self.progress)
        gc.collect()
        gc.freeze()  # what lives on is not looked through again while the arm moves
        self._quit.clear()
        self._thread = threading.Thread(target=self._run, name="flinch-control", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread and ask the arm to stand."""
        self._quit.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
            self.plant.send(np.zeros(self.robot.n), self._period)

    def close(self) -> None:
        """Stop, leave the arm at rest and give back every device."""
        try:
            self.stop()
        finally:
            for follower in self._followers:
                follower.close()
            self.plant.close()

    def _run(self) -> None:
        self._preferred = prefer_this_thread()
        try:
            while not self._quit.is_set():
                self.step()
        except Exception as error:
            # not even braking worked; everyone is told and the arm gets a last zero
            log.exception("the control thread has died")
            reason = f"the control thread has died: {error!r}"
            last, stamp = self.snapshots.get()
            if last is not None:
                status = Status(Mode.STOPPED, reason, self._clock.now())
                self.snapshots.put(replace(last, status=status), stamp)
            self.plant.send(np.zeros(self.robot.n), self._period)  # it may raise as well
