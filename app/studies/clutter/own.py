"""Our own narrow places, made by a seed: things on a table, an open box, a shelf.

Every problem can be solved as far as its ends go: start and goal are clear of everything, and the
arm has a posture for the goal. Whether a way leads there is for the controllers to find out.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from app.judge.truth import TrueDistance
from app.messages import Array, freeze
from app.poses import transform
from app.robot.model import Robot
from app.studies.clutter.problem import Problem, trouble
from app.world.motion import Still
from app.world.shapes import shape_of
from app.world.tables import BoxShape, CylinderShape
from app.world.world import Body

COLOUR = (200, 184, 154)
THICK = 0.02  # [m] of boards and walls
DOWN, AHEAD = (180.0, 0.0, -90.0), (-90.0, 0.0, -90.0)  # [degrees] where the tool looks
Made = tuple[list[Body], Array]  # bodies, and T_base_goal


def problem_of(robot: Robot, truth: TrueDistance, kind: str, seed: int) -> Problem:
    """The problem of a seed: drawn again until it is one for this arm."""
    rng = np.random.default_rng([seed, 17, list(SETS).index(kind)])
    while True:
        bodies, goal = SETS[kind](rng)
        problem = Problem(f"{kind} {seed}", robot.home, goal, tuple(bodies))
        if not trouble(robot, truth, problem, robot.home):
            return problem


def on_a_table(rng: np.random.Generator) -> Made:
    """Boxes and cans on a table, the goal low between them, from above."""
    top = float(rng.uniform(0.05, 0.25))
    bodies = [board("table", (0.75, 0.0, top - THICK / 2), (0.6, 1.2, THICK))]
    for i in range(int(rng.integers(4, 8))):
        x, y, high = rng.uniform((0.5, -0.5, 0.08), (1.0, 0.5, 0.25)).tolist()
        if rng.random() < 0.5:
            wide, deep = rng.uniform(0.05, 0.12, 2).tolist()
            bodies.append(board(f"box {i}", (x, y, top + high / 2), (wide, deep, high)))
        else:
            can = CylinderShape(radius_m=float(rng.uniform(0.03, 0.06)), length_m=high)
            bodies.append(body(f"can {i}", can, (x, y, top + high / 2)))
    x, y = rng.uniform((0.55, -0.4), (0.85, 0.4)).tolist()
    return bodies, tool((x, y, top + float(rng.uniform(0.08, 0.15))), DOWN)


def in_a_box(rng: np.random.Generator) -> Made:
    """A box without a lid, the goal in it."""
    x, y, wide, high = rng.uniform((0.55, -0.35, 0.35, 0.15), (0.75, 0.35, 0.5, 0.3)).tolist()
    half = wide / 2
    bodies = [board("bottom", (x, y, -THICK / 2), (wide, wide, THICK))]
    for name, dx, dy in (("back", half, 0), ("front", -half, 0), ("left", 0, half),
                         ("right", 0, -half)):  # fmt: skip
        size = (THICK, wide, high) if dx else (wide, THICK, high)
        bodies.append(board(name, (x + dx, y + dy, high / 2), size))
    return bodies, tool((x, y, float(rng.uniform(0.12, 0.12 + high / 2))), DOWN)


def in_a_shelf(rng: np.random.Generator) -> Made:
    """A shelf ahead, the goal in one of its two compartments."""
    x, y, low = rng.uniform((0.85, -0.2, 0.15), (1.0, 0.2, 0.3)).tolist()
    wide, deep, high = 0.8, 0.35, float(rng.uniform(0.35, 0.45))
    bodies = [board("back", (x + deep, y, low + high), (THICK, wide, 2 * high))]
    for i in range(3):
        at = (x + deep / 2, y, low + i * high)
        bodies.append(board(f"board {i}", at, (deep, wide, THICK)))
    for name, side in (("left", 0.5), ("right", -0.5)):
        at = (x + deep / 2, y + side * wide, low + high)
        bodies.append(board(name, at, (deep, THICK, 2 * high)))
    level = low + high * (0.5 + int(rng.integers(0, 2)))
    goal = (x + float(rng.uniform(0.0, 0.12)), y + float(rng.uniform(-0.2, 0.2)), level)
    return bodies, tool(goal, AHEAD)


SETS: dict[str, Callable[[np.random.Generator], Made]] = {
    "table": on_a_table, "box": in_a_box, "shelf": in_a_shelf,
}  # fmt: skip


def board(name: str, at: tuple[float, float, float], size: tuple[float, float, float]) -> Body:
    """A box of edges `size` [m] with its middle at `at` [m]."""
    return body(name, BoxShape(size), at)


def body(name: str, shape: BoxShape | CylinderShape, at: tuple[float, float, float]) -> Body:
    """What stands where it is for ever, its middle at `at` [m]."""
    T = transform(np.array(at), np.zeros(3))
    return Body(name, shape_of(shape, Path(), name), COLOUR, Still(freeze(T)), movable=False)


def tool(at: tuple[float, float, float], rpy_deg: tuple[float, float, float]) -> Array:
    """T_base_goal (4, 4)."""
    return transform(np.array(at), np.radians(rpy_deg))
