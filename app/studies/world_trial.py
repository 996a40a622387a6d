"""One controller in one random world: what it touched, and whether it kept every limit.

A trial is a pure function of its specification. It ends when the arm touches something.
"""

from collections import deque
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from app.actions import SetGoal
from app.config import Params
from app.control.registry import kind_of
from app.judge.blame import AHEAD, Judgement, Moment, seen_distances
from app.judge.contact import speed_towards
from app.judge.least import LeastDistance
from app.judge.run import JUDGED_EVERY
from app.judge.truth import TrueDistance
from app.messages import Array, Goal, Mode, Snapshot
from app.robot.arm import SimulatedArm
from app.robot.model import Robot
from app.robot.skin import Skin
from app.runtime import Engine
from app.sensing.simulated import SimulatedSkin
from app.studies.oracle import TruePerception
from app.studies.random_scene import random_goal, random_world
from app.studies.trial_log import Trial
from app.timing import ManualClock
from app.wiring import Setup, Start, assemble, build_robot_and_skin
from app.world.world import World

ORACLE = "oracle"  # the default controller that perceives the truth
NEW_GOAL = 4.0  # [s] between goals


class TrialSpec(NamedTuple):
    """mode: a controller's name, or `ORACLE`.   seconds: at most.   rate: [Hz] of its ticks."""

    seed: int
    mode: str
    seconds: float = 10.0
    rate: float = 125.0


class Stage(NamedTuple):
    """What every trial shares, made once a process."""

    robot: Robot
    skin: Skin
    truth: TrueDistance


@cache
def stage() -> Stage:
    """The UR10e with its skin."""
    robot, skin = build_robot_and_skin(Setup(robot="ur10e"))
    return Stage(robot, skin, TrueDistance([(b.vertices, b.faces) for b in robot.bodies]))


def run_spec(spec: TrialSpec) -> Trial:
    """The trial of a specification; one that dies is a trial with its cause."""
    try:
        return run_trial(stage(), spec)
    except Exception as error:
        return Trial(spec.seed, spec.mode, fault=f"the trial died: {error!r}")


def run_trial(stage: Stage, spec: TrialSpec, params: Params | None = None) -> Trial:
    """One controller in the world of a seed."""
    robot, truth = stage.robot, stage.truth
    rng = np.random.default_rng([spec.seed, 7])
    world = random_world(robot, truth, rng)
    goals = [random_goal(robot, rng) for _ in range(int(spec.seconds / NEW_GOAL) + 2)]
    engine = _engine(stage, spec, world, goals[0], params)
    trial = Trial(spec.seed, spec.mode)
    watch = _Watch(trial, stage, world, spec.rate, engine.brain.params.joint_speed)
    later = deque((turn * NEW_GOAL, goal) for turn, goal in enumerate(goals[1:], start=1))
    try:
        while trial.touch is None:
            s = engine.step()
            watch.update(s)
            if s.stamp >= spec.seconds:
                break
            if s.stamp >= later[0][0]:
                engine.post(SetGoal(later.popleft()[1].T_base_tool))
    finally:
        engine.close()
    return trial


def _engine(
    stage: Stage, spec: TrialSpec, world: World, goal: Goal, params: Params | None
) -> Engine:
    """Each controller as it is meant to be run: the paper's have no memory."""
    robot, skin, _ = stage
    mode = Params().mode if spec.mode == ORACLE else spec.mode
    chosen = replace(params or Params(memory=kind_of(mode).memory[0]), mode=mode)
    perception = TruePerception(robot, skin, world) if spec.mode == ORACLE else None
    start = Start(params=chosen, goal=goal, perception=perception)
    source, arm = SimulatedSkin(robot, skin, world, spec.seed), SimulatedArm(robot)
    return assemble(robot, skin, arm, source, world, ManualClock(), start, spec.rate)


class _Watch:
    def __init__(self, trial: Trial, stage: Stage, world: World, rate: float, speed: float) -> None:
        self._trial, self._robot, self._truth = trial, stage.robot, stage.truth
        self._moving = np.flatnonzero(self._robot.supports.any(axis=1))
        self._previous: Array = np.zeros(self._robot.n)
        self._period, self._judged = 1.0 / rate, -np.inf
        self._shapes = world.shapes()
        self._least = LeastDistance(self._truth, self._robot, self._moving, world)
        self._judgement = Judgement(self._robot, self._truth, self._shapes, speed)
        self._past: deque[Moment] = deque()

    def update(self, s: Snapshot) -> None:
        """Take note of one tick."""
        t, robot, qd = self._trial, self._robot, s.command.qd
        t.finite &= bool(np.isfinite(qd).all())
        t.speed = max(t.speed, float((np.abs(qd) - robot.qd_max).max()))
        rate_of_change = np.abs(qd - self._previous) / self._period - robot.qdd_max
        t.change = max(t.change, float(rate_of_change.max()))
        outside = np.maximum(s.joints.q - robot.q_max, robot.q_min - s.joints.q)
        t.reach = max(t.reach, float(outside.max()))
        self._previous = qd
        if s.status.mode is Mode.STOPPED and not t.fault:
            t.fault = s.status.reason
        if s.stamp < self._judged + JUDGED_EVERY:
            return
        self._judged = s.stamp
        seen = seen_distances(s.body, len(robot.links))
        self._past.append(Moment(s.stamp, s.joints.q, s.T_base_link, s.world, seen))
        while self._past[0].stamp <= s.stamp - AHEAD:
            self._past.popleft()
        t.least = self._least.update(s.T_base_link, s.world)
        if t.least <= 0.0:
            t.touch = self._touch(s)

    def _touch(self, s: Snapshot) -> dict[str, object]:
        """Of which link, by what, why, and who ran into whom."""
        now = self._past[-1]
        pairs = self._truth.near_pairs(now.T_base_link, self._shapes, now.bodies, 1e-9)
        pair = min((p for p in pairs if p.link in self._moving), key=lambda p: p.distance)
        first, every = self._judgement.blame(tuple(self._past), pair.link)
        return {
            "at_s": s.stamp,
            "link": self._robot.links[pair.link],
            "body": pair.body,
            "believed_m": float(now.seen[pair.link]),
            "own_mps": speed_towards(self._robot, now.q, s.joints.qd, pair),
            "slack_mps": s.command.slack,
            "arm_rad_s": float(np.abs(s.joints.qd).max()),
            "cause": first.value,
            "cause_every": every.value,
        }
