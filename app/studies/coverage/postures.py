"""Which postures a study of coverage looks at: home, all over the workspace, of a program or of
a recorded run."""

from pathlib import Path

import numpy as np
from scipy.stats import qmc

from app.control.clearance import Clearance
from app.control.goals import goal_error, goal_twist
from app.control.programs import Program, find_program, load_program
from app.errors import ConfigError
from app.messages import Array
from app.record.reader import open_recording
from app.robot.model import Robot

HOME, GRID, PROGRAM, RECORDING = "home", "grid", "program", "recording"
FLOOR = 0.0  # [m] links do not go below what the arm stands on
APART = 0.02  # [m] between links
DRAWN = 200  # postures for each one that is wanted, at most
DT, DAMPING, LONGEST = 0.1, 0.05, 60.0  # [s], [m], [s] of the way to a waypoint
KEPT = 200  # of a program or a recording, evenly over its time


def postures_of(wanted: str, robot: Robot) -> Array:
    """(m, n) joint positions of 'home', 'grid:N', 'program:NAME' or 'recording:FILE.mcap'."""
    kind, _, rest = wanted.partition(":")
    if kind == HOME and not rest:
        return np.array([robot.home])
    if kind == GRID and rest.isdecimal() and int(rest) > 0:
        return _grid(robot, int(rest))
    if kind == PROGRAM and rest:
        return _kept(_travelled(robot, load_program(find_program(rest))))
    if kind == RECORDING and rest:
        return _recorded(robot, Path(rest))
    raise ConfigError(
        f"postures = {wanted!r}; give home, grid:N, program:NAME or recording:FILE.mcap"
    )


def _grid(robot: Robot, count: int) -> Array:
    """Spread evenly over the joints' ranges (Halton), a turn at most, where no link touches
    another or goes below the floor."""
    clearance = Clearance(robot)
    low, high = np.maximum(robot.q_min, -np.pi), np.minimum(robot.q_max, np.pi)
    low, high = np.where(robot.slides, robot.q_min, low), np.where(robot.slides, robot.q_max, high)
    moving = np.flatnonzero(robot.supports.any(axis=1))
    out: list[Array] = []
    for point in qmc.Halton(robot.n, scramble=False).random(DRAWN * count + 1)[1:]:
        posture = robot.posture(low + (high - low) * point)
        T = posture.T_base_link
        lowest = min(
            float((robot.bodies[i].vertices @ T[i, 2, :3]).min() + T[i, 2, 3]) for i in moving
        )
        if lowest > FLOOR and not len(clearance.measure(posture, 0.0, APART).distance):
            out.append(posture.q)
            if len(out) == count:
                return np.array(out)
    raise ConfigError(
        f"only {len(out)} of {DRAWN * count} postures keep clear of the floor and of the arm; "
        "give a smaller grid:N"
    )


def _travelled(robot: Robot, program: Program) -> Array:
    """(m, n) postures on the way through a program's waypoints from home, `DT` apart: nothing is
    in the way."""
    q, out = robot.home.copy(), [robot.home.copy()]
    for waypoint in program.waypoints:
        for _ in range(round(LONGEST / DT)):
            posture = robot.posture(q)
            off, turn = goal_error(posture.T_base_tool, waypoint.T_base_tool)
            if off < program.reach and turn < program.reach_turn:
                break
            twist = goal_twist(
                posture.T_base_tool, waypoint.T_base_tool, program.speed, program.turn_speed
            )
            J = posture.tool_jacobian()
            qd = J.T @ np.linalg.solve(J @ J.T + DAMPING**2 * np.eye(6), twist)
            q = np.clip(q + DT * np.clip(qd, -robot.qd_max, robot.qd_max), robot.q_min, robot.q_max)
            out.append(q)
        else:
            raise ConfigError(
                f"program {program.name!r}: {robot.name} does not come to {waypoint.name!r}; "
                "move that waypoint, or give another program"
            )
    return np.array(out)


def _recorded(robot: Robot, path: Path) -> Array:
    with open_recording(path) as recording:
        ticks = _kept(np.arange(float(len(recording))))
        q = [recording.inputs(int(i)).joints.q for i in ticks]
    if not q or len(q[0]) != robot.n:
        what = f"of {len(q[0])} joints, {robot.name} has {robot.n}" if q else "without a tick"
        raise ConfigError(f"{path}: a recording {what}; give one of this robot")
    return np.array(q)


def _kept(every: Array) -> Array:
    """`KEPT` of them at most, the first and the last among them."""
    if len(every) <= KEPT:
        return every
    return every[np.linspace(0, len(every) - 1, KEPT).round().astype(np.int64)]
