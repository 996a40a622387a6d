"""Random worlds: does any controller ever exceed a limit, and when does the QP touch something?

A world has one to four bodies around the arm, half of them moving, and a goal that jumps. The
same seed gives the same world to each controller. A touch counts against a controller only
where it could have been avoided: the touched link's own distance was perceived within `TRUE`
of the truth all through the last `AHEAD` seconds, and all that time there was a free direction
(see `app.studies.free_direction`). Both are asked in the same way of every controller. The
other touches are listed with their cause.
"""

from collections import Counter, deque
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from app.actions import SetGoal
from app.config import Params
from app.control.registry import kind_of, taking_part
from app.judge.least import LeastDistance
from app.judge.run import JUDGED_EVERY
from app.judge.truth import TrueDistance
from app.messages import Array, Goal, Mode, Snapshot, freeze
from app.poses import transform
from app.report import Check, Report
from app.robot.arm import SimulatedArm
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.simulated import SimulatedSkin
from app.studies.free_direction import free_direction
from app.studies.headless import step_until
from app.studies.trial_log import Trial, TrialLog
from app.timing import ManualClock
from app.wiring import Setup, Start, assemble, build_robot_and_skin
from app.world.motion import motion_of
from app.world.shapes import shape_of
from app.world.tables import BoxShape, CapsuleShape, LineMotion, SphereShape
from app.world.world import Body, World

OURS = Params().mode  # the controller that is blamed for what it touches
AHEAD = 0.5  # [s] an obstacle must have been seen before a touch
TRUE = 0.10  # [m] perceived minus true distance up to which it counts as seen
CLEAR = 0.35  # [m] true distance of every body at the start
NEW_GOAL = 4.0  # [s] between goals
ROUNDING = 1e-9


def random_worlds(
    worlds: int, seconds: float, seed: int = 0, rate: float = 125.0, log: Path | None = None
) -> Report:
    """`worlds` worlds for `seconds` each, under every controller.

    log: a file of trials; those in it are not run again, and each new one is added to it.
    """
    done = TrialLog(log, {"seconds": seconds, "rate": rate})
    modes = [kind.name for kind in taking_part("worlds")]
    wanted = [(seed + i, mode) for i in range(worlds) for mode in modes]
    _run(done, done.missing(wanted), seconds, rate)
    trials = [done.done[w] for w in wanted]
    return _report(trials, worlds, seconds, seed)


def _run(log: TrialLog, wanted: list[tuple[int, str]], seconds: float, rate: float) -> None:
    if not wanted:
        return
    robot, skin = build_robot_and_skin(Setup(robot="ur10e"))
    truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
    for seed, mode in wanted:
        log.add(run_trial(robot, skin, truth, seed, mode, seconds, rate))


def _report(trials: list[Trial], worlds: int, seconds: float, seed: int) -> Report:
    modes = list(dict.fromkeys(t.mode for t in trials))
    rows = [_row(mode, [t for t in trials if t.mode == mode], seconds) for mode in modes]
    rows += [
        {"name": f"touch {t.mode} seed {t.seed}", **t.touch} for t in trials if t.touch is not None
    ]
    rows += [{"name": f"fault {t.mode} seed {t.seed}", "fault": t.fault} for t in trials if t.fault]
    blamed = sum(
        1 for t in trials if t.mode == OURS and t.touch and t.touch["cause"] == "avoidable"
    )
    checks = [
        Check("worlds", float(worlds), "", 1000.0, at_least=True),
        Check("excess over a velocity limit", max(t.speed for t in trials), "rad/s", ROUNDING),
        Check(
            "excess over an acceleration limit", max(t.change for t in trials), "rad/s^2", ROUNDING
        ),
        Check("excess over a position limit", max(t.reach for t in trials), "rad", ROUNDING),
        Check("commands not finite", float(sum(not t.finite for t in trials)), "", 0.0),
        Check("exceptions", float(sum(bool(t.fault) for t in trials)), "", 0.0),
        Check(f"{OURS}: touches seen ahead with a free direction", float(blamed), "", 0.0),
    ]
    return Report("random worlds", seed, rows, checks)


def run_trial(
    robot: Robot,
    skin: Skin,
    truth: TrueDistance,
    seed: int,
    mode: str,
    seconds: float,
    rate: float,
    params: Params | None = None,
) -> Trial:
    """One controller in the world of `seed`."""
    rng = np.random.default_rng([seed, 7])
    world = random_world(robot, truth, rng)
    goals = [random_goal(robot, rng) for _ in range(int(seconds / NEW_GOAL) + 2)]
    source = SimulatedSkin(robot, skin, world, seed)
    arm = SimulatedArm(robot)
    # each as it is meant to be run: the paper's have no memory
    chosen = params or Params(memory=kind_of(mode).memory[0])
    chosen = replace(chosen, mode=mode)
    engine = assemble(
        robot, skin, arm, source, world, ManualClock(), Start(params=chosen, goal=goals[0]), rate
    )
    trial = Trial(seed, mode)
    later = deque((turn * NEW_GOAL, goal) for turn, goal in enumerate(goals[1:], start=1))

    def set_next_goal(s: Snapshot) -> None:
        if s.stamp >= later[0][0]:
            engine.post(SetGoal(later.popleft()[1].T_base_tool))

    step_until(engine, seconds, _Watch(trial, robot, truth, world, rate).update, set_next_goal)
    return trial


class _Past(NamedTuple):
    """A judged moment: true and perceived distance of each moving link, and its nearest body."""

    snapshot: Snapshot
    true: Array
    seen: Array
    nearest: list[str]


class _Watch:
    def __init__(
        self, trial: Trial, robot: Robot, truth: TrueDistance, world: World, rate: float
    ) -> None:
        self._trial, self._robot, self._truth, self._world = trial, robot, truth, world
        self._moving = np.flatnonzero(robot.supports.any(axis=1))
        self._previous = np.zeros(robot.n)
        self._period, self._judged = 1.0 / rate, -np.inf
        self._least = LeastDistance(truth, robot, self._moving, world)
        self._past: deque[Snapshot] = deque()

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
        self._past.append(s)
        while self._past[0].stamp <= s.stamp - AHEAD:
            self._past.popleft()
        t.least = self._least.update(s.T_base_link, s.world)
        if t.least <= 0.0 and t.touch is None:
            t.touch = self._judge(s)

    def _measured(self, s: Snapshot) -> _Past:
        found = self._truth.nearest(s.T_base_link, self._world, poses=s.world)
        seen = np.full(len(found), np.inf)
        np.minimum.at(seen, s.body.link, s.body.distance)
        true, nearest = zip(*(found[i] for i in self._moving), strict=True)
        return _Past(s, np.array(true), seen[self._moving], list(nearest))

    def _judge(self, s: Snapshot) -> dict[str, Any]:
        """The first touch: of which link, by what, and why."""
        past = [self._measured(p) for p in self._past]
        i = int(np.argmin(past[-1].true))
        seen = all(p.seen[i] - p.true[i] <= TRUE for p in past)
        free = all(self._free(a, b) for a, b in pairwise(past))
        passed = max(past[-1].snapshot.stamp - past[0].snapshot.stamp, 1e-9)
        cause = "avoidable" if free else "no free direction"
        if not seen:
            cause = f"not seen {AHEAD:g} s ahead"
        return {
            "at_s": s.stamp,
            "link": self._robot.links[int(self._moving[i])],
            "body": past[-1].nearest[i],
            "believed_m": float(past[-1].seen[i]),
            "closing_mps": float((past[0].true[i] - past[-1].true[i]) / passed),
            "slack_mps": max(p.snapshot.command.slack for p in past),
            "arm_rad_s": float(np.abs(s.joints.qd).max()),
            "cause": cause,
        }

    def _free(self, a: _Past, b: _Past) -> bool:
        """Was there a way out at `a`, for the speed at which the obstacles came until `b`?"""
        s, robot = a.snapshot, self._robot
        posture, body = robot.posture(s.joints.q), s.body
        J = posture.distance_rows(body.link, body.on_robot, body.normal)
        opening = np.zeros(len(robot.links))
        passed = b.snapshot.stamp - s.stamp
        opening[self._moving] = (b.true - a.true) / passed
        coming = np.nan_to_num(J @ s.joints.qd - opening[body.link], nan=0.0, posinf=0.0)
        return free_direction(robot, posture, body, coming, s.params.joint_speed)


def random_world(robot: Robot, truth: TrueDistance, rng: np.random.Generator) -> World:
    """One to four bodies around the arm, none near it at first."""
    home = robot.posture(robot.home).T_base_link
    moving = np.flatnonzero(robot.supports.any(axis=1))
    bodies: list[Body] = []
    wanted = int(rng.integers(1, 5))
    while len(bodies) < wanted:
        body = _random_body(f"body {len(bodies) + 1}", rng)
        if truth.measure(home, World([body]))[moving].min() > CLEAR:
            bodies.append(body)
    return World(bodies)


def random_goal(robot: Robot, rng: np.random.Generator) -> Goal:
    """A pose that the arm can have, above the table."""
    while True:
        T = robot.posture(robot.home + rng.uniform(-0.8, 0.8, robot.n)).T_base_tool
        if T[2, 3] > 0.2:
            return Goal(freeze(T.copy()))


def _random_body(name: str, rng: np.random.Generator) -> Body:
    kind = rng.choice(["sphere", "box", "capsule"])
    table: BoxShape | SphereShape | CapsuleShape
    if kind == "box":
        table = BoxShape(tuple(rng.uniform(0.1, 0.4, 3).tolist()))
    elif kind == "sphere":
        table = SphereShape(float(rng.uniform(0.05, 0.15)))
    else:
        table = CapsuleShape(float(rng.uniform(0.05, 0.15)), float(rng.uniform(0.2, 0.6)))
    start, end = _place(rng, 0.5, 1.6), _place(rng, 0.3, 0.9)
    T = transform(start, rng.uniform(-1.0, 1.0, 3))
    script = None
    if rng.random() < 0.5:
        speed = float(rng.uniform(0.1, 0.5))
        script = LineMotion(tuple(end.tolist()), speed, dwell_s=1.0)
    shape = shape_of(table, Path(), name)
    return Body(name, shape, (150, 150, 150), motion_of(script, T, name))


def _place(rng: np.random.Generator, near: float, far: float) -> Array:
    r, turn = rng.uniform(near, far), rng.uniform(-np.pi, np.pi)
    return np.array([r * np.cos(turn), r * np.sin(turn), rng.uniform(0.0, 1.0)])


def _row(mode: str, trials: list[Trial], seconds: float) -> dict[str, Any]:
    least = np.array([t.least for t in trials])
    causes = Counter(t.touch["cause"] for t in trials if t.touch)
    return {
        "name": mode,
        "worlds": len(trials),
        "seconds_each": seconds,
        "touches": sum(causes.values()),
        "causes": dict(causes),
        "median_least_m": float(np.median(least)),
        "p10_least_m": float(np.percentile(least, 10)),
    }
