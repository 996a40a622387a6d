"""Worlds that a seed makes: bodies around the arm, and goals that it can reach."""

from pathlib import Path

import numpy as np

from app.judge.truth import TrueDistance
from app.messages import Array, Goal, freeze
from app.poses import transform
from app.robot.model import Robot
from app.world.motion import motion_of
from app.world.shapes import shape_of
from app.world.tables import BoxShape, CapsuleShape, LineMotion, SphereShape
from app.world.world import Body, World

CLEAR = 0.35  # [m] true distance of every body at the start


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
