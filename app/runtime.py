"""The engine: one paced thread that drains actions, runs the tick and publishes a snapshot.

    actions ─► world, sensors ─► pipeline ─► supervisor ─► arm ─► Latest[Snapshot]

Motion stops on any doubt, with a reason: sensors fall silent, a number is not finite, the
recording ends, an exception escapes a room. Only a person's action sets it going again.
"""

import logging
import queue
import sys
import threading
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Protocol

import numpy as np

from app.actions import (
    Action,
    AddObstacle,
    DiscardBackground,
    ForgetBackground,
    KeepBackground,
    LearnBackground,
    MoveObstacle,
    RemoveObstacle,
    RunProgram,
    SetGoal,
    SetMode,
    SetParams,
    SetPose,
    UseSensor,
)
from app.cell.files import load_cell, save_learned
from app.cell.parts import Cell
from app.config import Params, change
from app.control.programs import Program, ProgramRun, pose_of
from app.control.supervisor import Supervisor, speed_share
from app.errors import ConfigError, FlinchError, SensorError, options
from app.ghost import Ghost
from app.messages import (
    Array,
    GhostState,
    Goal,
    JointState,
    Mode,
    Snapshot,
    Timing,
    freeze,
)
from app.perception.health import SkinHealth
from app.pipeline import Outcome, Pipeline, rehearse
from app.robot.model import Robot
from app.robot.posture import rigid
from app.robot.skin import Skin
from app.sensing.mixed import MixedSkin
from app.sensing.source import Source
from app.tick import ArmReport
from app.timing import Clock, Latest, Stopwatch, Ticker
from app.world.world import World

log = logging.getLogger(__name__)
SWITCH = 1e-3  # [s] the control thread waits no longer for another one; 5 ms is a whole tick
SILENT_SHARE = 0.5  # of the connected sensors: from this share on the arm is blind


class Arm(Protocol):
    """What the engine needs of an arm; `send` returns what was really applied."""

    def state(self, now: float) -> JointState: ...
    def report(self, now: float) -> ArmReport: ...  # once a tick, before `send`
    def send(self, qd: Array, dt: float) -> Array: ...
    def engage(self) -> None: ...  # a person asks for motion; returns at once
    def close(self) -> None: ...


class Engine:
    """Owns every part of a running arm. `step` is one tick; `start` runs it in a thread."""

    def __init__(
        self,
        robot: Robot,
        skin: Skin,
        arm: Arm,
        source: Source,
        world: World,
        clock: Clock,
        *,
        params: Params | None = None,
        goal: Goal | None = None,
        rate: float = 250.0,
        scene: str = "",
        programs: Mapping[str, Program] | None = None,
        background: Path | None = None,
        ghost: Ghost | None = None,
        cell: Cell | None = None,
    ) -> None:
        self.robot, self.skin, self.scene, self.world = robot, skin, scene, world
        self.snapshots: Latest[Snapshot] = Latest()
        self._arm, self._source, self._clock = arm, source, clock
        self._params = params or Params()
        self._period = 1.0 / rate
        self._actions: queue.SimpleQueue[Action] = queue.SimpleQueue()
        self.cell = cell or Cell()
        if background is not None and background.exists():
            self.cell = replace(self.cell, learned=load_cell(background).learned)
        self._pipeline = Pipeline(robot, skin, self.cell)
        self._background = background  # file of the learned background
        self._health = SkinHealth(source.connected)
        self._born = clock.now()
        self._listening = self._born  # silence is counted from here until a sensor speaks
        self._supervisor = Supervisor(Mode.IDLE, self._born, "waits for the first frames")
        self._ticker = Ticker(clock, self._period)
        self._last_stamp: float | None = None
        self._tick = 0
        self._notice = ""
        self._late = ""
        self._said = ArmReport()  # by the arm, in this tick
        self._began = False
        here = Goal(freeze(robot.posture(arm.state(self._born).q).T_base_tool.copy()))
        self._goal = goal or here
        self._programs = dict(programs or {})
        self._ghost = ghost
        self._seen_ghost: GhostState | None = None
        self._program: ProgramRun | None = None
        self._held = here
        self._thread: threading.Thread | None = None
        self._quit = threading.Event()

    @property
    def source(self) -> str:
        """Where the frames come from, in words."""
        return self._source.name

    @property
    def params(self) -> Params:
        """The settings in force."""
        return self._params

    @property
    def programs(self) -> tuple[str, ...]:
        """Names of the waypoint programs that can be run."""
        return tuple(self._programs)

    @property
    def reached(self) -> int:
        """Waypoints reached by the program that runs, 0 without one."""
        return self._program.reached if self._program else 0

    def ended(self) -> bool:
        """Will no frame ever come again?"""
        return bool(self._source.ended())

    @property
    def ticker(self) -> Ticker:
        """Pace and lateness of the loop."""
        return self._ticker

    def post(self, action: Action) -> None:
        """Queue an action for the head of the next tick; thread-safe, returns at once."""
        self._actions.put(action)

    # --- one tick -------------------------------------------------------------------------

    def step(self) -> Snapshot:
        """One tick at the clock's time; never raises for what a stop can answer."""
        late = self._ticker.wait()
        now = self._clock.now()
        elapsed = self._period if self._last_stamp is None else now - self._last_stamp
        dt = min(max(elapsed, 0.1 * self._period), 5.0 * self._period)
        self._last_stamp = now
        if late > self._params.frame_age:
            # it was this machine that stalled, not the sensors; wait for fresh frames, though
            self._listening = now
        watch = Stopwatch()
        self._drain(now)
        joints = self._arm.state(now)
        try:
            if not (np.isfinite(joints.q).all() and np.isfinite(joints.qd).all()):
                raise FlinchError("the arm reports a joint value that is not finite")
            self.world.step(now - self._born)
            posture = self.robot.posture(joints.q)
            frames = self._source.poll(now, posture)
            watch.lap("simulate")
            self._health.connect(self._source.connected)
            self._health.update(frames, now)
            if not self._began and self._health.heard_since(self._born):
                self._began = True
                self._supervisor.ready(now)
            share = self._doubt(now)
            mode = self._supervisor.mode
            moving = mode in (Mode.RUNNING, Mode.HOLDING)
            moving = moving and self._health.heard_since(self._listening) and self._said.ready
            if self._program and mode is Mode.RUNNING and moving:
                self._goal = self._program.update(posture.T_base_tool, dt)
            goal = self._goal if mode is Mode.RUNNING else self._held
            if self._pipeline.background.finish(now):
                self._notice = f"learned {len(self._pipeline.background.preview)} cubes; keep them?"
            outcome = self._pipeline.tick(
                frames, joints, goal, self._params, dt, moving, watch, share
            )
            if not np.isfinite(outcome.command.qd).all():
                raise FlinchError("the controller asked for a joint velocity that is not finite")
            self._arm.send(outcome.command.qd, dt)
            watch.lap("drive")
            if self._ghost:
                self._seen_ghost = self._ghost.update(goal, self._params, now, dt, moving)
                watch.lap("ghost")
        except Exception as error:
            # whatever went wrong, the arm stops; the reason is shown and the trace is logged
            if self._supervisor.mode is not Mode.STOPPED:
                log.exception("tick %d failed; the arm stops", self._tick)
            reason = str(error) if isinstance(error, FlinchError) else f"internal error: {error!r}"
            self._supervisor.fault(reason, now)
            outcome = self._blind(joints, dt)
        snapshot = self._snapshot(now, joints, outcome, watch, late)
        self.snapshots.put(snapshot, now)
        self._tick += 1
        return snapshot

    def _doubt(self, now: float) -> float:
        """Stop where the sensors give a reason to, else the share of the speed to go on with."""
        self._said = self._arm.report(now)
        for reason in (self._said.fault, self._source.ended()):
            if reason:
                self._supervisor.fault(reason, now)
        limit = self._params.silence
        broken = self._source.fault(now, limit, self._source.connected)
        if broken:
            self._supervisor.fault(broken, now)
        silent = self._health.silent(now, limit, self._listening)
        connected = int(self._source.connected.sum())
        if connected and silent >= SILENT_SHARE * connected:
            self._supervisor.fault(
                f"{silent} of {connected} sensors silent for more than {limit:g} s", now
            )
        age = self._health.age(now, self._listening, SILENT_SHARE)
        share = speed_share(age, self._params.slow_after, limit)
        self._late = "" if share == 1.0 else f"slow: the sensors are silent for {age:.1f} s"
        return share

    def _blind(self, joints: JointState, dt: float) -> Outcome:
        """The outcome of a tick that failed: brake, with the last cloud that is left."""
        finite = np.isfinite(joints.q).all()
        safe = joints if finite else JointState(joints.stamp, self.robot.home, self.robot.home * 0)
        outcome = self._pipeline.brake(safe, self._params, dt)
        if finite:
            self._arm.send(outcome.command.qd, dt)
        return outcome

    def _snapshot(
        self, now: float, joints: JointState, outcome: Outcome, watch: Stopwatch, late: float
    ) -> Snapshot:
        return Snapshot(
            tick=self._tick,
            stamp=now,
            joints=joints,
            T_base_link=outcome.posture.T_base_link,
            T_base_tool=outcome.posture.T_base_tool,
            goal=self._goal,
            cloud=outcome.cloud,
            pairs=outcome.pairs,
            body=outcome.body,
            command=outcome.command,
            status=self._supervisor.status,
            params=self._params,
            health=freeze(self._health.states(now, self._params.frame_age)),
            rate=freeze(self._health.rates()),
            world=self.world.poses(),
            timing=Timing(watch.laps, late),
            notice=self._notice,
            jump=outcome.jump,
            advice=self._said.advice or self._late or outcome.command.reason,
            program=self._program.words if self._program else "",
            memory=outcome.memory,
            ghost=self._seen_ghost,
            delay=freeze(self._health.delays()),
            inputs=self._source.inputs(now),
            background=self._pipeline.background.view(now),
            real=self._source.real if isinstance(self._source, MixedSkin) else None,
        )

    # --- actions --------------------------------------------------------------------------

    def _drain(self, now: float) -> None:
        while True:
            try:
                action = self._actions.get_nowait()
            except queue.Empty:
                return
            try:
                self._act(action, now)
                self._notice = ""
            except (FlinchError, ValueError) as refused:
                self._notice = str(refused)

    def _act(self, action: Action, now: float) -> None:
        match action:
            case SetGoal(T_base_tool=T):
                self._goal, self._program = Goal(freeze(rigid(T))), None
            case SetPose(position=position, rpy=rpy):
                T = rigid(pose_of(position, np.array(rpy)))
                self._goal, self._program = Goal(freeze(T)), None
            case RunProgram(name=name):
                self._run_program(name, now)
            case SetParams(changes=changes):
                self._params = change(self._params, changes)
            case SetMode(mode=mode, reason=reason):
                if mode is Mode.HOLDING:
                    q = self._arm.state(now).q
                    self._held = Goal(freeze(self.robot.posture(q).T_base_tool.copy()))
                if mode is not Mode.STOPPED:
                    self._listening = now
                    self._arm.engage()
                self._supervisor.request(mode, reason, now)
            case AddObstacle(name=name, shape=shape, position=position):
                self.world.add(name, shape, position)
            case MoveObstacle(name=name, T_base_body=T):
                self.world.move(name, rigid(T))
            case RemoveObstacle(name=name):
                self.world.remove(name)
            case LearnBackground(seconds=seconds):
                self._pipeline.background.learn(now, seconds)
            case KeepBackground():
                self._pipeline.background.keep()
                self._pipeline.know()
                if self._background is not None:
                    save_learned(self._background, self._pipeline.background.known)
            case DiscardBackground():
                self._pipeline.background.discard()
            case ForgetBackground():
                self._pipeline.background.forget()
                self._pipeline.know()
            case UseSensor(sensor=sensor, real=real):
                if not isinstance(self._source, MixedSkin):
                    raise SensorError(
                        f"{self._source.name} cannot be switched; start with a mixed skin, "
                        "--sensors serial:PORT+simulated"
                    )
                self._source.use(self.skin.index(sensor), real)

    def _run_program(self, name: str, now: float) -> None:
        """Begin a program where the tool is; an empty name rests at the present goal."""
        if name and name not in self._programs:
            raise ConfigError(f"no program {name!r}; {options(name, self._programs)}")
        tool = self.robot.posture(self._arm.state(now).q).T_base_tool
        self._program = ProgramRun(self._programs[name], tool.copy()) if name else None

    # --- the thread -----------------------------------------------------------------------

    def start(self) -> None:
        """Run ticks in a thread of their own until `stop`."""
        if self._thread is not None:
            raise RuntimeError("the engine runs already")
        sys.setswitchinterval(SWITCH)
        rehearse(self.robot, self.skin, self.cell, self._params)
        self._listening = self._clock.now()
        self._thread = threading.Thread(target=self._run, name="flinch-control", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread, leave the arm at rest and close the source."""
        self._quit.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        try:
            self._arm.close()
        finally:
            self._source.close()

    def _run(self) -> None:
        try:
            while not self._quit.is_set():
                self.step()
        except Exception as error:
            # not even braking worked; everyone is told and the arm gets a last zero
            log.exception("the control thread has died")
            self._supervisor.fault(f"the control thread has died: {error!r}", self._clock.now())
            last, stamp = self.snapshots.get()
            if last is not None:
                self.snapshots.put(replace(last, status=self._supervisor.status), stamp)
            self._arm.send(np.zeros(self.robot.n), self._period)  # it may raise as well
