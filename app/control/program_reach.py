"""Can the arm get there? Each waypoint of a program tried before the start, on paper.

Damped least squares from the home posture and from postures all over the joints' ranges

    dq = J' (J J' + DAMPING^2 I)^-1 e        e: the error, shortened to a step; q kept in its limits

finds the tool's nearest pose with the joints in their ranges; of those that are near enough one
must also leave the arm clear of the known cell. It is a search, no proof: what is told is the
nearest pose that was found.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from app.cell.parts import Cell
from app.control.clearance import Clearance
from app.control.goals import goal_error
from app.control.limits import MARGIN
from app.control.programs import Program, Waypoint
from app.messages import Array
from app.robot.model import Robot
from app.robot.posture import rotation_vector

DAMPING = 0.02
STEP, TURN = 0.15, 0.4  # [m], [rad] of the error in one step
STEPS = 120  # of a try
SEEDS, MORE = 10, 60  # tries until one comes near; until one that is near is clear of the cell
EXACT, EXACT_TURN = 1e-3, 5e-3  # [m], [rad] near enough to end a try
ALONG = 40  # poses that are tried on the way to one that lies in the cell


class Found(NamedTuple):
    """A posture q (n,) whose tool is `away` [m] and `turned` [rad] from what was asked for."""

    q: Array
    away: float
    turned: float


def reach_words(program: Program, robot: Robot, cell: Cell) -> tuple[str, ...]:
    """One line for each waypoint that the arm cannot reach, with the nearest pose that it can."""
    clearance, out = Clearance(robot, cell), []
    q = robot.home
    for w in program.waypoints:
        tries: list[Found] = []
        near: list[Found] = []
        for begin in _begins(robot, q):
            tries.append(_towards(robot, w.T_base_tool, begin))
            if tries[-1].away <= program.reach and tries[-1].turned <= program.reach_turn:
                near.append(tries[-1])
                if not _inside(robot, clearance, cell, near[-1].q):
                    break
            if not near and len(tries) > SEEDS:
                break
        else:
            out.append(_in_cell(program, w, robot, clearance, cell, near[0], q))
            continue
        if near:
            q = near[-1].q
        else:
            best = min(tries, key=lambda f: (round(f.away, 3), f.turned))
            out.append(_beyond(program, w, robot, best))
    return tuple(out)


def _begins(robot: Robot, q: Array) -> Iterator[Array]:
    """Where searches begin: at the waypoint before, at home, and all over the ranges."""
    rng = np.random.default_rng(0)
    low, high = np.maximum(robot.q_min, -np.pi), np.minimum(robot.q_max, np.pi)
    yield q
    yield robot.home
    yield from rng.uniform(np.minimum(low, high), high, (MORE, robot.n))


def _towards(robot: Robot, goal: Array, q: Array) -> Found:
    """From q as near to the goal as this way leads."""
    margin = np.minimum(MARGIN, 0.4 * (robot.q_max - robot.q_min))
    low, high = robot.q_min + margin, robot.q_max - margin
    q, best = np.clip(q, low, high), Found(q, np.inf, np.inf)
    for _ in range(STEPS):
        posture = robot.posture(robot.gears.place(q))
        away, turned = goal_error(posture.T_base_tool, goal)
        if (away + 0.1 * turned) < (best.away + 0.1 * best.turned):
            best = Found(robot.gears.place(q), away, turned)
        if away < EXACT and turned < EXACT_TURN:
            break
        line = goal[:3, 3] - posture.T_base_tool[:3, 3]
        turn = rotation_vector(goal[:3, :3] @ posture.T_base_tool[:3, :3].T)
        error = np.concatenate((_short(line, STEP), _short(turn, TURN)))
        J = posture.tool_jacobian()
        q = np.clip(q + J.T @ np.linalg.solve(J @ J.T + DAMPING**2 * np.eye(6), error), low, high)
    return best


def _short(v: Array, most: float) -> Array:
    return v * min(1.0, most / max(float(np.linalg.norm(v)), 1e-12))


def _inside(robot: Robot, clearance: Clearance, cell: Cell, q: Array) -> str:
    """The part of the cell that the arm is in at q, "its own body", or nothing."""
    gaps = clearance.measure(robot.posture(q), 0.0)
    for part in gaps.part:
        return repr(cell.names[part]) if part >= 0 else "its own body"
    return ""


def _beyond(program: Program, w: Waypoint, robot: Robot, best: Found) -> str:
    """Too far away, or only turned otherwise; a joint at its end is named."""
    turns = best.away <= program.reach
    lacks = f"{np.degrees(best.turned):.0f} deg" if turns else f"{best.away:.2f} m"
    margin = 2.0 * MARGIN
    ends = [
        name
        for name, q, low, high in zip(robot.joints, best.q, robot.q_min, robot.q_max, strict=True)
        if q - low < margin or high - q < margin
    ]
    why = f" ({', '.join(ends)} at the end)" if ends else ""
    far = float(np.linalg.norm(w.T_base_tool[:3, 3]))
    unit = "; is it in millimetres? metres are meant" if far > 20.0 else ""
    return f"{_of(program, w)}: {lacks} are lacking{why}{unit}; {_nearest(robot, best.q)}"


def _in_cell(
    program: Program, w: Waypoint, robot: Robot, clearance: Clearance, cell: Cell,
    there: Found, q: Array,
) -> str:  # fmt: skip
    """Reached only with the arm in the known cell; the nearest pose on the way that is clear."""
    what = _inside(robot, clearance, cell, there.q)
    last = q
    for share in np.linspace(0.0, 1.0, ALONG):
        at = robot.gears.place(q + share * (there.q - q))
        if _inside(robot, clearance, cell, at):
            break
        last = at
    return f"{_of(program, w)}: the arm would be in {what}; {_nearest(robot, last)}"


def _of(program: Program, w: Waypoint) -> str:
    return f"{program.name}: waypoint {w.name!r} cannot be reached"


def _nearest(robot: Robot, q: Array) -> str:
    """The tool's pose at q as a program's file has it."""
    T = robot.posture(q).T_base_tool
    place = ", ".join(f"{v:.3f}" for v in T[:3, 3])
    R = T[:3, :3]
    roll, yaw = np.arctan2(R[2, 1], R[2, 2]), np.arctan2(R[1, 0], R[0, 0])
    pitch = np.arctan2(-R[2, 0], np.hypot(R[2, 1], R[2, 2]))
    turns = ", ".join(f"{v:.0f}" for v in np.degrees((roll, pitch, yaw)))
    return f"the nearest found is position_m = [{place}], rpy_deg = [{turns}]"
