"""One controller in one random world: what it touched, and whether it kept every limit.

A trial is a pure function of its specification. It ends when the arm touches something.
"""

from collections import deque
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from app.actions import SetGoal
from app.cell.parts import Cell
from app.choices import build_robot_and_skin
from app.errors import ConfigError
from app.judge.blame import AHEAD, Judgement, Moment, seen_distances
from app.judge.contact import speed_towards
from app.judge.least import LeastDistance
from app.judge.run import JUDGED_EVERY
from app.judge.truth import TrueDistance
from app.messages import Array, Goal, Mode, Snapshot
from app.perception.perceiver import Perceiver
from app.plant.simulated import SimulatedPlant
from app.robot.arm import SimulatedArm
from app.robot.model import Robot
from app.robot.skin import Skin
from app.runtime import Engine
from app.sensing.budget import read_budget
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.studies.conditions import Condition, read_condition
from app.studies.one_pair import OnePairALink
from app.studies.oracle import TruePerception
from app.studies.random_scene import random_goal, random_world
from app.studies.trial import TrialResult, TrialSpec
from app.timing import ManualClock
from app.wiring import Start, assemble
from app.world.world import World

NEW_GOAL = 4.0  # [s] between goals


class Stage(NamedTuple):
    """What every trial shares, made once a process."""

    robot: Robot
    skin: Skin
    truth: TrueDistance  # of the robot as it is believed to be


@dataclass
class Found:
    """What one controller did in one world; excesses over limits, worst of all ticks."""

    least: float = np.inf  # [m] true distance
    speed: float = -np.inf  # [rad/s]
    change: float = -np.inf  # [rad/s^2] of the command
    reach: float = -np.inf  # [rad]
    finite: bool = True
    stop: str = ""
    touch: dict[str, Any] | None = None


@cache
def stage(skin: str = "") -> Stage:
    """The UR10e in a skin, its own where none is named."""
    robot, laid = build_robot_and_skin(Setup(robot="ur10e", skin=skin))
    return Stage(robot, laid, TrueDistance([(b.vertices, b.faces) for b in robot.bodies]))


def run_world(spec: TrialSpec) -> TrialResult:
    """The trial of a specification."""
    c = condition(spec.condition)
    found = run_trial(stage(c.skin or spec.skin), spec, c)
    return TrialResult(spec.seed, spec.condition, asdict(found))


def condition(name: str) -> Condition:
    """The condition of a name; ConfigError for one that is not tried in random worlds."""
    c = read_condition(name, sides=False)
    if c.alone or c.fault:
        raise ConfigError(f"condition {name!r}: random worlds know neither alone nor faults")
    return c


def run_trial(stage: Stage, spec: TrialSpec, c: Condition) -> Found:
    """One controller in the world of a seed."""
    robot, truth = stage.robot, stage.truth
    rng = np.random.default_rng([spec.seed, 7])
    world = random_world(robot, truth, rng)
    goals = [random_goal(robot, rng) for _ in range(int(spec.seconds / NEW_GOAL) + 2)]
    engine = _engine(stage, spec, c, world, goals[0])
    found = Found()
    watch = _Watch(found, engine, truth, spec.rate)
    later = deque((turn * NEW_GOAL, goal) for turn, goal in enumerate(goals[1:], start=1))
    try:
        while found.touch is None:
            s = engine.step()
            watch.update(s)
            if s.stamp >= spec.seconds:
                break
            if s.stamp >= later[0][0]:
                engine.post(SetGoal(later.popleft()[1].T_base_tool))
    finally:
        engine.close()
    return found


def _engine(stage: Stage, spec: TrialSpec, c: Condition, world: World, goal: Goal) -> Engine:
    robot, skin, _ = stage
    perception: Perceiver | None = TruePerception(robot, skin, world) if c.oracle else None
    if c.one_pair:
        perception = OnePairALink(robot, skin, world, Cell())
    start = Start(params=c.params(), goal=goal, perception=perception)
    budget = read_budget(c.budget(spec.world))
    source = SimulatedSkin(robot, skin, world, spec.seed, budget=budget)
    arm = SimulatedArm(robot, noise=source.truth.encoders, seed=spec.seed)
    return assemble(robot, skin, arm, source, world, ManualClock(), start, spec.rate)


class _Watch:
    """The judge of one trial: it looks at the plant, where everything is as it is."""

    def __init__(self, found: Found, engine: Engine, truth: TrueDistance, rate: float) -> None:
        plant = engine.plant
        assert isinstance(plant, SimulatedPlant)
        self._plant, robot, believed = plant, plant.robot, engine.robot
        if robot.bodies is not believed.bodies:
            truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
        self._found, self._robot, self._truth = found, robot, truth
        self._moving = np.flatnonzero(robot.supports.any(axis=1))
        self._previous: Array = np.zeros(robot.n)
        self._period, self._judged = 1.0 / rate, -np.inf
        self._shapes = plant.world.shapes()
        self._least = LeastDistance(truth, robot, self._moving, plant.world)
        speed = engine.brain.params.joint_speed
        self._judgement = Judgement(robot, truth, self._shapes, speed)
        self._past: deque[Moment] = deque()

    def update(self, s: Snapshot) -> None:
        """Take note of one tick."""
        t, robot, qd = self._found, self._robot, s.command.qd
        t.finite &= bool(np.isfinite(qd).all())
        t.speed = max(t.speed, float((np.abs(qd) - robot.qd_max).max()))
        rate_of_change = np.abs(qd - self._previous) / self._period - robot.qdd_max
        t.change = max(t.change, float(rate_of_change.max()))
        outside = np.maximum(s.joints.q - robot.q_max, robot.q_min - s.joints.q)
        t.reach = max(t.reach, float(outside.max()))
        self._previous = qd
        if s.status.mode is Mode.STOPPED and not t.stop:
            t.stop = s.status.reason
        if s.stamp < self._judged + JUDGED_EVERY:
            return
        self._judged = s.stamp
        seen, T = seen_distances(s.body, len(robot.links)), self._plant.true_poses()
        self._past.append(Moment(s.stamp, s.joints.q, T, s.world, seen))
        while self._past[0].stamp <= s.stamp - AHEAD:
            self._past.popleft()
        t.least = self._least.update(T, s.world)
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
            "phantom_m": self._judgement.phantom(tuple(self._past)),
            "own_mps": speed_towards(self._robot, now.q, s.joints.qd, pair),
            "slack_mps": s.command.slack,
            "arm_rad_s": float(np.abs(s.joints.qd).max()),
            "cause": first.value,
            "cause_every": every.value,
        }
