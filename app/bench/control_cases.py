"""What a control step is given in a bench: moments of runs, and moments with nothing in common."""

from typing import NamedTuple

import numpy as np

from app.bench.standalone import Standalone
from app.config import Params
from app.messages import Array, Goal, JointState, Pairs
from app.robot.model import Robot
from app.robot.posture import Posture

DT = 0.004  # [s]
FAR = 0.59  # [m] just inside d_inf
NEAR = 0.15  # [m] no pair is nearer at first
BALL = 0.06  # [m] radius of the ball around a link's origin that the pairs are measured from
RUN = 100  # ticks of one run


class Case(NamedTuple):
    """One moment. first: it has nothing to do with the one before."""

    posture: Posture
    joints: JointState
    pairs: Pairs
    goal: Goal
    first: bool = True


def make_runs(
    robot: Robot, k: int, count: int, seed: int, far: float = FAR, near: float = NEAR
) -> list[Case]:
    """`count` moments of runs of `RUN` ticks with `k` still points, `near` to `far` [m] away.

    In each run the arm obeys the QP, so the rows are those that hold an arm back which has come
    to where they hold it: with `far` at d_s it begins inside all of them.
    """
    rng = np.random.default_rng([seed, k, 1])
    control, params = Standalone(robot, "qp"), Params(mode="qp")
    moving = np.flatnonzero(robot.supports.any(axis=1))
    cases: list[Case] = []
    while len(cases) < count:
        q = robot.home + rng.uniform(-0.5, 0.5, robot.n)
        start = robot.posture(q)
        link = np.sort(np.resize(moving[1:], k))
        away = rng.uniform(near, far, k) + BALL
        n = _directions(rng, k)
        world = start.T_base_link[link, :3, 3] - away[:, None] * n
        goal = Goal(robot.posture(q + rng.uniform(-0.3, 0.3, robot.n)).T_base_tool)
        qd = np.zeros(robot.n)
        control.reset()
        for i in range(min(RUN, count - len(cases))):
            posture, joints = robot.posture(q), JointState(i * DT, q, qd)
            pairs = _pairs(posture, link, world)
            cases.append(Case(posture, joints, pairs, goal, i == 0))
            qd = control.step(Case(posture, joints, pairs, goal), params, DT).qd
            q = q + qd * DT
    return cases


def make_cases(robot: Robot, k: int, count: int, seed: int, far: float = FAR) -> list[Case]:
    """Random postures near home with `k` pairs on moving links, NEAR to `far` [m] away.

    Up to d_inf few rows can be broken within one tick and the rest are left out; with `far`
    at d_s every row demands a retreat, most of them against each other.
    """
    rng = np.random.default_rng([seed, k])
    moving = np.flatnonzero(robot.supports.any(axis=1))
    cases = []
    for _ in range(count):
        q = robot.home + rng.uniform(-0.5, 0.5, robot.n)
        posture = robot.posture(q)
        link = np.sort(np.resize(moving[1:], k))
        n = _directions(rng, k)
        on = posture.T_base_link[link, :3, 3] - BALL * n
        d = rng.uniform(NEAR, far, k)
        pairs = Pairs(link, d, on, on - d[:, None] * n, n, np.arange(k), int(np.argmin(d)))
        goal = Goal(robot.posture(q + rng.uniform(-0.3, 0.3, robot.n)).T_base_tool)
        cases.append(Case(posture, JointState(0.0, q, np.zeros(robot.n)), pairs, goal))
    return cases


def _pairs(posture: Posture, link: np.ndarray, world: Array) -> Pairs:
    """The links' balls and points (k, 3) of the world."""
    centre = posture.T_base_link[link, :3, 3]
    away = np.linalg.norm(centre - world, axis=1)
    n = (centre - world) / away[:, None]
    d = away - BALL
    return Pairs(link, d, centre - BALL * n, world, n, np.arange(len(d)), int(np.argmin(d)))


def _directions(rng: np.random.Generator, k: int) -> Array:
    n = rng.normal(size=(k, 3))
    return np.asarray(n / np.linalg.norm(n, axis=1)[:, None])
