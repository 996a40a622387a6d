"""Can a pose be reached at all, and by how much not? Joints and their ranges alone are asked.

Damped least squares from a few postures, damped by the error (Sugihara, "Solvability-unconcerned
inverse kinematics", 2011); whoever is nearest is the answer. An estimate: a pose that only a
posture far from all of these reaches is told to be out of reach.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from app.control.limits import MARGIN
from app.messages import Array
from app.robot.model import Robot
from app.robot.posture import rotation_vector

TURN = 0.3  # [m/rad] what a turn counts beside a way, as in the quadratic programme
STEPS, STARTS, LONGEST = 80, 8, 0.5  # steps of each start, further starts, [rad] of one step
THERE, THERE_TURN = 2e-3, 0.01  # [m], [rad] as good as reached
DAMPING = 1e-5  # beside half of the error's square


class Short(NamedTuple):
    """What is left at the nearest posture that was found: [m] and [rad]; both 0: reached."""

    way: float
    turn: float

    @property
    def words(self) -> str:
        """For a person; empty where it is reached."""
        parts = []
        if self.way > 0.0:
            cm = 100.0 * self.way
            parts.append(f"{cm:.0f} cm short" if cm >= 1.0 else f"{10.0 * cm:.0f} mm short")
        if self.turn > 0.0:
            parts.append(f"{np.degrees(self.turn):.0f}° off")
        return f"cannot be reached: {', '.join(parts)}" if parts else ""


class Reach:
    """One arm's; with kinematics of its own, so that any one thread may ask."""

    def __init__(self, robot: Robot) -> None:
        self._robot = replace(robot, _data=robot._model.createData())
        low, high = robot.q_min + MARGIN, robot.q_max - MARGIN
        rng = np.random.default_rng(0)
        others = rng.uniform(np.maximum(low, -np.pi), np.minimum(high, np.pi), (STARTS, robot.n))
        self._low, self._high, self._starts = low, high, (robot.home, *others)

    def short(self, T_base_goal: Array, q: Array) -> Short:
        """How much is missing of a pose (4, 4) for an arm that is at q (n,)."""
        best, least = Short(np.inf, np.inf), np.inf
        for start in (q, *self._starts):
            found = self._from(start, T_base_goal)
            error = found.way + TURN * found.turn
            if error < least:
                best, least = found, error
            if best == Short(0.0, 0.0):
                break
        return best

    def _from(self, q: Array, T_base_goal: Array) -> Short:
        weight = np.array([1.0, 1.0, 1.0, TURN, TURN, TURN])
        best, least = Short(np.inf, np.inf), np.inf
        q = np.clip(q, self._low, self._high)
        for _ in range(STEPS):
            posture = self._robot.posture(q)
            T = posture.T_base_tool
            e = np.concatenate(
                (T_base_goal[:3, 3] - T[:3, 3], rotation_vector(T_base_goal[:3, :3] @ T[:3, :3].T))
            )
            way, turn = float(np.linalg.norm(e[:3])), float(np.linalg.norm(e[3:]))
            if way + TURN * turn < least:
                least = way + TURN * turn
                best = Short(way if way > THERE else 0.0, turn if turn > THERE_TURN else 0.0)
            if best == Short(0.0, 0.0):
                break
            J = weight[:, None] * posture.tool_jacobian()
            step = J.T @ np.linalg.solve(
                J @ J.T + (DAMPING + 0.5 * float(e @ e)) * np.eye(6), weight * e
            )
            q = np.clip(q + step / max(1.0, np.abs(step).max() / LONGEST), self._low, self._high)
        return best
