"""Nothing is near the arm: how often is it held by a phantom of its own body?

The arm goes through random goals in an empty room, with everything that perception does. A tick
is held when a bound that the controller keeps comes from a point of the world: there is none.

`calibrated` is what is left after a calibration, drawn anew: each sensor known to 0.7 mm and 0.1
degrees a component, its zones to 0.3 % of the distance, and said to be so.
"""

import time
from collections import deque
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.actions import SetGoal
from app.choices import build_robot_and_skin
from app.config import Params
from app.errors import ConfigError, options
from app.messages import Array, Snapshot, Verdict, freeze
from app.report import Check, Report
from app.robot.arm import SimulatedArm
from app.robot.doubt import Doubt
from app.robot.model import Robot
from app.robot.posture import rotation_matrix
from app.robot.skin import Skin, build_skin
from app.robot.tables import Choice
from app.sensing.budget import Budget, read_budget
from app.sensing.error_model import ErrorModel
from app.sensing.latency import ESTIMATED
from app.sensing.simulated import SimulatedSkin
from app.sensing.truth import draw_truth
from app.setup import Setup
from app.studies.headless import step_until
from app.studies.random_scene import random_goal
from app.timing import ManualClock
from app.wiring import Start, assemble
from app.world.world import World

POSITION, ANGLE, SHARE = 0.7e-3, np.radians(0.1), 0.003  # 1 sigma, left by a calibration
NEW_GOAL = 4.0  # [s] between goals
TOOL = "screwdriver"
AS_LAID_OUT, CALIBRATED = 0.01, 0.001  # most of the ticks that may be held


@dataclass(frozen=True)
class Condition:
    """What a trial differs in from the honest world as it is.

    calibrated: see the module.   sub: rays in a row that a zone is integrated with.
    late_ms: stamps come so much after the light, and are believed to be known to 15 ms.
    """

    name: str
    calibrated: bool = False
    sub: int = 5
    late_ms: float = 0.0
    tool: str = ""

    def budget(self, world: str) -> Budget:
        """The errors that are drawn."""
        return replace(read_budget(world), sub=self.sub, late_ms=self.late_ms)


CONDITIONS = (
    Condition("as laid out"),
    Condition("calibrated", calibrated=True),
    Condition("30 ms late", late_ms=30.0),
    Condition("calibrated, 4x4 sub-rays", calibrated=True, sub=4),
    Condition("calibrated, 7x7 sub-rays", calibrated=True, sub=7),
    Condition("with a tool", tool=TOOL),
    Condition("calibrated, with a tool", calibrated=True, tool=TOOL),
)


def choose(names: tuple[str, ...]) -> tuple[Condition, ...]:
    """The conditions of these names, all without any; ConfigError lists the names."""
    known = {c.name: c for c in CONDITIONS}
    for name in names:
        if name not in known:
            raise ConfigError(f"no condition {name!r}; {options(name, known)}")
    return tuple(known[name] for name in names) or CONDITIONS


def phantoms(
    seeds: int,
    seconds: float,
    seed: int = 0,
    conditions: tuple[Condition, ...] = CONDITIONS,
    world: str = "honest",
    rate: float = 125.0,
) -> Report:
    """`seeds` trials of `seconds` each under every condition."""
    rows: list[dict[str, Any]] = []
    for c in conditions:
        robot, skin = build_robot_and_skin(Setup(robot="ur10e", choice=Choice(tool=c.tool)))
        trials = [trial(robot, skin, c, seed + i, seconds, world, rate) for i in range(seeds)]
        held = np.array([t["held"] for t in trials])
        worst = int(held.argmax())
        rows.append(
            {"name": c.name, "trials": seeds, "seconds": seconds}
            | {key: float(np.mean([t[key] for t in trials])) for key in trials[0]}
            | {"worst": float(held[worst]), "worst_seed": seed + worst}
        )
    checks = [
        Check(
            f"ticks held, {r['name']}", r["held"], "", CALIBRATED if c.calibrated else AS_LAID_OUT
        )
        for r, c in zip(rows, conditions, strict=True)
    ]
    return Report("phantoms", seed, rows, checks)


def trial(
    robot: Robot, skin: Skin, c: Condition, seed: int, seconds: float, world: str, rate: float
) -> dict[str, float]:
    """Shares of the ticks that were held, and that believed in a point or remembered one; how far
    the tool went [m], and what the trial took [s]."""
    begin, budget = time.perf_counter(), c.budget(world)
    believed, errors = believed_skin(robot, skin, c, budget, seed)
    eye = SimulatedSkin(robot, skin, World(()), seed, errors, budget=budget)
    arm = SimulatedArm(robot, noise=eye.truth.encoders, seed=seed)
    rng = np.random.default_rng([seed, 11])
    goals = [random_goal(robot, rng) for _ in range(int(seconds / NEW_GOAL) + 2)]
    engine = assemble(
        robot, believed, arm, eye, World(()), ManualClock(), Start(params=Params(), goal=goals[0]),
        rate,
    )  # fmt: skip
    later = deque((i * NEW_GOAL, goal) for i, goal in enumerate(goals[1:], start=1))
    ticks: list[tuple[bool, bool, bool]] = []
    way: list[Array] = []

    def watch(s: Snapshot) -> None:
        if s.stamp >= later[0][0]:
            engine.post(SetGoal(later.popleft()[1].T_base_tool))
        acts = s.command.activation > 0.0 and s.command.control_row >= 0
        ticks.append((acts, bool((s.cloud.verdict == Verdict.KEPT).any()), len(s.memory) > 0))
        way.append(s.T_base_tool[:3, 3])

    step_until(engine, seconds, watch)
    held, seen, remembered = np.mean(ticks, axis=0).tolist()
    path = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    took = time.perf_counter() - begin
    return {
        "held": held, "believed": seen, "remembered": remembered, "path_m": path, "took_s": took,
    }  # fmt: skip


def believed_skin(
    robot: Robot, skin: Skin, c: Condition, budget: Budget, seed: int
) -> tuple[Skin, ErrorModel]:
    """What is believed of the skin, and the errors that its zones still have."""
    errors = ErrorModel()
    if c.calibrated:
        skin, left = calibrated(robot, skin, budget, seed), SHARE / skin.doubt.share[0]
        errors = ErrorModel(bias=float(left))
    if c.late_ms:
        late = freeze(np.full(skin.count, ESTIMATED))
        skin = replace(skin, doubt=replace(skin.doubt, time=late))
    return skin, errors


def calibrated(robot: Robot, skin: Skin, budget: Budget, seed: int) -> Skin:
    """The true skin of a seed, less well known than it is."""
    rng = np.random.default_rng([seed, 13])
    true = draw_truth(robot, skin, budget, seed).skin
    sensors = []
    for laid_out, there in zip(skin.sensors, true.sensors, strict=True):
        D = np.eye(4)
        D[:3, :3] = rotation_matrix(ANGLE * rng.standard_normal(3))
        D[:3, 3] = POSITION * rng.standard_normal(3)
        sensors.append(replace(laid_out, T_link_sensor=freeze(there.T_link_sensor @ D)))
    position, angle, share = (freeze(np.full(skin.count, x)) for x in (POSITION, ANGLE, SHARE))
    doubt = Doubt(position, angle, share, skin.doubt.time, skin.doubt.joint)
    return replace(build_skin(skin.title, tuple(sensors), robot), doubt=doubt)
