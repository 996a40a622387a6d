"""Whole-body control by one quadratic programme: every near pair is a bound.

What is not dangerous is not touched, several threats are met at once, and a change of the
closest pair does not move the arm, since the other pair was a bound already. The joints'
limits are hard; see `app.control.rows` for the bounds and `app.control.qp` for the costs.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.cell.parts import Cell
from app.compiled import compiled
from app.config import Params
from app.control.goals import goal_twist
from app.control.limits import bring_into, next_box, velocity_box
from app.control.manipulability import manipulability, manipulability_gradient
from app.control.qp import Costs, solve
from app.control.rows import Bounds, reach
from app.control.separation import ages, in_use, needed
from app.control.steady_rows import SteadyRows
from app.errors import FlinchError
from app.messages import Array, Command, Goal, JointState, Pairs, freeze
from app.robot.model import Robot
from app.robot.posture import Posture

SINGULAR = 0.02  # manipulability [m^3] below which damping begins, for an arm of about 1 m
LAMBDA_Q, LAMBDA_SINGULAR, LAMBDA_A = 1e-3, 0.05, 2e-3
PUSH = 0.02  # weight of the way out of a singularity
ASTRAY = 0.2  # [rad/s] the arm does not follow: start from what was measured
GIVES_WAY = 1e-3  # [m/s] slack from which on a bound counts as relaxed
RELAXED_AFTER, RELAXED_SHARE = 0.2, 0.25  # [s], and the share of the speed from then on
EASE_SHARE = 0.4  # [s] for the whole of the speed, so that slowing is no jolt
UNSOLVED = 3  # ticks in a row
EASE = 0.08  # [s] of each of two stages that ease the goal's twist in


class WholeBody:
    """Turns pairs and a goal into joint velocities that keep every limit."""

    def __init__(self, robot: Robot, cell: Cell | None = None) -> None:
        self._robot = robot
        self.bounds = Bounds(robot, cell)
        self._steady = SteadyRows()
        self.reset()

    def reset(self, previous: Array | None = None) -> None:
        """Start again from rest, or from the command `previous` (n,) that is in force."""
        self.previous = np.zeros(self._robot.n) if previous is None else previous
        self._unsolved, self._relaxed, self._share = 0, 0.0, 1.0
        self._eased = np.zeros((2, 6))
        self._steady.reset()

    def update(
        self,
        posture: Posture,
        joints: JointState,
        pairs: Pairs,
        goal: Goal | None,
        params: Params,
        dt: float,
        approach: Array | None = None,
        share: float = 1.0,
    ) -> Command:
        """The next command; `goal` None means: rest where you are, but give way.

        approach: (B,) [m/s] speed of each pair's world point towards the robot.
        share: 0..1 of the allowed speed, less while the sensors are silent.
        Raises a FlinchError when there was no answer several times in a row.
        """
        relaxed = self._relaxed > RELAXED_AFTER
        aim = RELAXED_SHARE if relaxed else 1.0
        self._share += min(max(aim - self._share, -dt / EASE_SHARE), dt / EASE_SHARE)
        previous = self._in_force(joints)
        speed = params.speed * share * self._share
        low, high = next_box(self._robot, joints.q, speed, dt, previous)
        steady, source = self._steady.update(posture, pairs, approach, reach(params), dt)
        protective = 0.0
        if in_use(params):
            steady = replace(steady, age=_ages(pairs, source, params.frame_age))
            J = posture.distance_rows(steady.link, steady.on_robot, steady.normal)
            protective = needed(steady, -J @ joints.qd, params)
        rows = self.bounds.rows(posture, steady, params, low, high, previous, dt)
        costs = self._costs(posture, goal, params, previous, dt)
        answer = solve(costs, rows, low, high, params.lexicographic)
        if answer is None:
            self._unsolved += 1
            if self._unsolved >= UNSOLVED:
                raise FlinchError("the bounds had no solution three times in a row; clear the arm")
            return self._braked(joints, dt, "brakes: the bounds had no solution")
        self._unsolved = 0
        self.previous = answer.qd
        first, slack, gave = _tell(answer.slack, answer.tight, rows.low, rows.source, rows.inside)
        self._relaxed = self._relaxed + dt if gave else 0.0
        acted = int(rows.source[first]) if first >= 0 else -1
        return Command(
            qd=freeze(answer.qd.copy()),
            activation=float(first >= 0),
            reference=float(rows.low[first]) if first >= 0 else 0.0,
            scale=min(max(answer.progress, 0.0), 1.0),
            control_row=int(source[acted]) if acted >= 0 else -1,
            slack=slack,
            protective=protective,
            reason="slow: too close on more sides than it can leave" if relaxed else "",
        )

    def brake(self, joints: JointState, dt: float) -> Command:
        """As fast to rest as the acceleration limits allow."""
        return self._braked(joints, dt, "")

    def _braked(self, joints: JointState, dt: float, reason: str) -> Command:
        box = velocity_box(self._robot, joints.q, 1.0, dt)
        qd, _ = bring_into(np.zeros(self._robot.n), self.previous, box)
        self.previous, self._eased[:] = qd, 0.0
        return Command(qd=freeze(qd.copy()), reason=reason)

    def _in_force(self, joints: JointState) -> Array:
        """The last command, or what the arm really does where it does not follow."""
        return joints.qd if _farther(joints.qd, self.previous, ASTRAY) else self.previous

    def _costs(
        self, posture: Posture, goal: Goal | None, params: Params, previous: Array, dt: float
    ) -> Costs:
        tool = posture.tool_jacobian()
        twist = np.zeros(6)
        if goal is not None:
            twist = goal_twist(
                posture.T_base_tool, goal.T_base_tool, params.lambda_p, params.lambda_o,
                params.v_max, params.w_max,
            )  # fmt: skip
        _ease(self._eased, min(dt / EASE, 1.0), twist)
        mu = manipulability(tool)
        lost = max(0.0, 1.0 - mu / SINGULAR)
        push = np.zeros(len(previous))
        if mu < 2.0 * SINGULAR and goal is not None:
            push = PUSH * manipulability_gradient(posture, mu)
        return Costs(
            tool, twist, previous, push, params.k_g, params.k_b,
            LAMBDA_Q + LAMBDA_SINGULAR * lost * lost, LAMBDA_A, params.slide,
        )  # fmt: skip


def _ages(pairs: Pairs, source: NDArray[np.intp], lost: float) -> Array:
    """(m,) [s] of the pairs that each of those followed came from; `lost` for one out of sight."""
    age = ages(pairs)
    return np.where(source >= 0, age[source], lost) if len(age) else np.full(len(source), lost)


@compiled
def _farther(a: Array, b: Array, limit: float) -> bool:
    """Does any part of a differ from b by more than the limit?"""
    out = False
    for j in range(len(a)):
        out |= abs(a[j] - b[j]) > limit
    return out


@compiled
def _ease(stages: Array, share: float, twist: Array) -> None:
    """Let the twist (6,) through the stages (2, 6): a goal that jumps is no step of the speed."""
    for stage in stages:
        for i in range(len(twist)):
            stage[i] += share * (twist[i] - stage[i])
            twist[i] = stage[i]


@compiled
def _tell(
    slack: Array,
    tight: NDArray[np.bool_],
    low: Array,
    source: NDArray[np.int64],
    inside: NDArray[np.bool_],
) -> tuple[int, float, bool]:
    """The bound that holds the arm most, -1 for none, the largest slack, and if one gave way.

    The world's bounds are told of first, the robot's own only without any of them.
    """
    first, most, gave = -1, 0.0, False
    for i in range(len(low)):
        most = max(most, slack[i])
        gave |= inside[i] and slack[i] > GIVES_WAY
        if not tight[i]:
            continue
        world, before = source[i] >= 0, first >= 0 and source[first] >= 0
        if first < 0 or (world and not before) or (world == before and low[i] >= low[first]):
            first = i
    return first, most, gave
