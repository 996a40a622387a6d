"""Whole-body control by one quadratic programme: every near pair is a bound.

What is not dangerous is not touched, several threats are met at once, and a change of the
closest pair does not move the arm, since the other pair was a bound already. The joints'
limits are hard; see `app.control.bounds` for the bounds and `app.control.qp` for the costs.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.control.bounds.cell import CellBounds
from app.control.bounds.gap_rows import MOST
from app.control.bounds.own_body import OwnBodyBounds
from app.control.bounds.pairs import PairBounds
from app.control.bounds.rows import Bound, Rows, empty_sheet, rows_of
from app.control.bounds.separation import SeparationBounds
from app.control.clearance import Clearance
from app.control.controller import Situation
from app.control.goals import goal_twist
from app.control.limits import Step, braked, next_step
from app.control.manipulability import manipulability, manipulability_gradient
from app.control.qp import Answer, Costs, solve
from app.control.separation import needed
from app.control.wish import costs_of, joints_for, unchanged
from app.errors import FlinchError
from app.messages import Array, Command, JointState, freeze
from app.robot.model import Robot

SINGULAR = 0.02  # manipulability [m^3] below which damping begins, for an arm of about 1 m
# Weights of the joints' speed, more of it near a singularity, and of its change: enough to make
# the answer unique; more of the last, 0.05, delays evasion (specification, section 4.3)
LAMBDA_Q, LAMBDA_SINGULAR, LAMBDA_A = 1e-3, 0.05, 2e-3
K_G, K_B = 10.0, 0.5  # only their ratio counts beside these (specification, section 4.1)
PUSH = 0.02  # weight of the way out of a singularity (specification, section 4.3)
ASTRAY = 0.2  # [rad/s] the arm does not follow: start from what was measured (section 4.6)
GIVES_WAY = 1e-3  # [m/s] slack from which on a bound counts as relaxed (section 4.7)
RELAXED_AFTER, RELAXED_SHARE = 0.2, 0.25  # [s], and the share of the speed then (section 4.7)
EASE_SHARE = 0.4  # [s] for the whole of the speed, so that slowing is no jolt
UNSOLVED = 3  # ticks in a row that stop the arm (section 4.7)
# [s] of each of two stages that ease the goal's twist in: a goal that jumps then makes a jerk of
# 150 rad/s^3 at most; a step of the acceleration within its limit alone would be 750
EASE = 0.08
NO_ANSWER = "the bounds had no solution three times in a row; clear the arm"


class QpController:
    """Turns pairs and a goal into joint velocities that keep every limit.

    gives_way: pairs are bounds that may demand a retreat; else speed and separation only slows.
    """

    def __init__(self, robot: Robot, clearance: Clearance, *, gives_way: bool = True) -> None:
        self._robot, self._gives_way = robot, gives_way
        self._separation = SeparationBounds()
        self._pairs: tuple[Bound, ...] = (PairBounds(),) if gives_way else ()
        self._own: tuple[Bound, ...] = (OwnBodyBounds(clearance), CellBounds(clearance))
        self.reset()

    def reset(self) -> None:
        """Nothing was in the way, and there was no goal."""
        self._unsolved, self._relaxed, self._share = 0, 0.0, 1.0
        self._eased = np.zeros((2, 6))

    def update(self, now: Situation) -> Command:
        """The next command."""
        relaxed = self._relaxed > RELAXED_AFTER
        aim = RELAXED_SHARE if relaxed else 1.0
        self._share += min(max(aim - self._share, -now.dt / EASE_SHARE), now.dt / EASE_SHARE)
        previous = _in_force(now.joints, now.applied)
        speed = now.params.joint_speed * now.share * self._share
        step = next_step(self._robot, now.joints.q, speed, now.dt, previous)
        separates = not self._gives_way or now.params.separation
        bounds = (*self._pairs, *((self._separation,) if separates else ()), *self._own)
        sheet = empty_sheet(2 * (len(now.pairs.distance) + MOST), self._robot.n)
        for bound in bounds:
            bound.append(now, step, sheet)
        rows = rows_of(sheet)
        answer = self._answer(now, rows, step)
        if answer is None:
            return self._unanswered(now)
        self._unsolved = 0
        return self._command(now, answer, rows, relaxed, needed_by(now) if separates else 0.0)

    def _answer(self, now: Situation, rows: Rows, step: Step) -> Answer | None:
        """The step that the bounds leave of what is asked for; None where none was found."""
        if now.wish is not None:
            self._eased[:] = 0.0  # the goal's twist begins anew after it
            qd = joints_for(now.wish, now.posture)
            same = unchanged(qd, rows.jacobian, rows.low, step.low, step.high)
            if same is not None:
                return same
            slide = now.params.slide_along
            costs = costs_of(now.wish, qd, now.posture, K_G, K_B, LAMBDA_A, slide)
        else:
            costs = self._costs(now, step.previous)
        strict = now.params.bounds_first
        return solve(costs, rows, step.low, step.high, strict, now.params.solver)

    def _command(
        self, now: Situation, answer: Answer, rows: Rows, relaxed: bool, protective: float
    ) -> Command:
        first, slack, gave = _held(answer.slack, answer.tight, rows.low, rows.source, rows.inside)
        self._relaxed = self._relaxed + now.dt if gave else 0.0
        return Command(
            qd=freeze(answer.qd),
            activation=float(first >= 0),
            reference=float(rows.low[first]) if first >= 0 else 0.0,
            progress=min(max(answer.progress, 0.0), 1.0),
            control_row=int(rows.source[first]) if first >= 0 else -1,
            slack=slack,
            protective=protective,
            reason="slow: too close on more sides than it can leave" if relaxed else "",
        )

    def _unanswered(self, now: Situation) -> Command:
        """Brake; the goal's twist begins anew after it."""
        self._unsolved += 1
        if self._unsolved >= UNSOLVED:
            raise FlinchError(NO_ANSWER)
        self._eased[:] = 0.0
        qd = braked(self._robot, now.joints.q, now.dt, now.applied)
        return Command(qd=freeze(qd), reason="brakes: the bounds had no solution")

    def _costs(self, now: Situation, previous: Array) -> Costs:
        params, tool, twist = now.params, now.posture.tool_jacobian(), np.zeros(6)
        if now.goal is not None:
            twist = goal_twist(
                now.posture.T_base_tool, now.goal.T_base_tool,
                params.goal_speed, params.goal_turning,
            )  # fmt: skip
        _ease(self._eased, min(now.dt / EASE, 1.0), twist)
        mu = manipulability(tool)
        lost = max(0.0, 1.0 - mu / SINGULAR)
        push = np.zeros(len(previous))
        if mu < 2.0 * SINGULAR and now.goal is not None:
            push = PUSH * manipulability_gradient(now.posture, mu)
        return Costs(
            tool, twist, previous, push, K_G, K_B,
            LAMBDA_Q + LAMBDA_SINGULAR * lost * lost, LAMBDA_A, params.slide_along,
        )  # fmt: skip


def needed_by(now: Situation) -> float:
    """[m] that speed and separation asks of the nearest pair at the measured speed."""
    J = now.posture.distance_rows(now.pairs.link, now.pairs.on_robot, now.pairs.normal)
    return needed(now.pairs, -J @ now.joints.qd, now.params)


def _in_force(joints: JointState, applied: Array) -> Array:
    """The last command, or what the arm really does where it does not follow."""
    return joints.qd if _farther(joints.qd, applied, ASTRAY) else applied


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
def _held(
    slack: Array,
    tight: NDArray[np.bool_],
    low: Array,
    source: NDArray[np.int64],
    inside: NDArray[np.int64],
) -> tuple[int, float, bool]:
    """The bound that holds the arm most, -1 for none, the largest slack, and if one gave way.

    The world's bounds are told of first, the robot's own only without any of them.
    """
    first, most, gave = -1, 0.0, False
    for i in range(len(low)):
        most = max(most, slack[i])
        gave |= inside[i] != 0 and slack[i] > GIVES_WAY
        if not tight[i]:
            continue
        world, before = source[i] >= 0, first >= 0 and source[first] >= 0
        if first < 0 or (world and not before) or (world == before and low[i] >= low[first]):
            first = i
    return first, most, gave
