"""Whole-body control by one quadratic programme: every near pair is a bound.

What is not dangerous is not touched, several threats are met at once, and a change of the
closest pair does not move the arm, since the other pair was a bound already. The joints'
limits are hard; see `app.control.rows` for the bounds and `app.control.qp` for the costs.
"""

from collections.abc import Sequence

import numpy as np

from app.config import Params
from app.control.clearance import Clearance
from app.control.goals import goal_twist
from app.control.limits import bring_into, velocity_box
from app.control.manipulability import manipulability, manipulability_gradient
from app.control.qp import Costs, solve
from app.control.rows import (
    SELF_WITHIN,
    Rows,
    avoidance_rows,
    eased,
    joined,
    own_rows,
    reach,
    that_can_bite,
)
from app.control.steady_rows import SteadyRows
from app.errors import FlinchError
from app.messages import Array, Command, CropBox, Goal, JointState, Pairs, freeze
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

    def __init__(self, robot: Robot, crops: Sequence[CropBox] = ()) -> None:
        self._robot = robot
        self._clearance = Clearance(robot, crops)
        self._steady = SteadyRows()
        self.reset()
        self._warm_up()

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
        low, high = self._box(joints, params.speed * share * self._share, dt, previous)
        steady, source = self._steady.update(posture, pairs, approach, reach(params), dt)
        rows = eased(self._rows(posture, steady, params, low, high), self._robot, previous, dt)
        costs = self._costs(posture, goal, params, previous, dt)
        answer = solve(costs, rows, low, high, params.lexicographic)
        if answer is None:
            self._unsolved += 1
            if self._unsolved >= UNSOLVED:
                raise FlinchError("the bounds had no solution three times in a row; clear the arm")
            return self._braked(joints, dt, "brakes: the bounds had no solution")
        self._unsolved = 0
        self.previous = answer.qd
        gave = (answer.slack > GIVES_WAY) & rows.inside
        self._relaxed = self._relaxed + dt if gave.any() else 0.0
        held = np.flatnonzero(answer.tight)
        # the world's bounds are told of first, the robot's own only without any of them
        order = np.lexsort((rows.low[held], rows.source[held] >= 0))
        first = int(held[order[-1]]) if len(held) else -1
        acted = int(rows.source[first]) if first >= 0 else -1
        return Command(
            qd=freeze(answer.qd.copy()),
            activation=float(len(held) > 0),
            reference=float(rows.low[first]) if first >= 0 else 0.0,
            scale=min(max(answer.progress, 0.0), 1.0),
            control_row=int(source[acted]) if acted >= 0 else -1,
            slack=float(answer.slack.max(initial=0.0)),
            reason="slow: too close on more sides than it can leave" if relaxed else "",
        )

    def _warm_up(self) -> None:
        """Compile what is compiled on first use now, not while the arm moves."""
        robot = self._robot
        posture = robot.posture(robot.home)
        link = np.array([len(robot.links) - 1])
        on = posture.T_base_tool[None, :3, 3]
        n = np.array([[1.0, 0.0, 0.0]])
        pairs = Pairs(link, np.array([0.4]), on, on - 0.4 * n, n, np.zeros(1, dtype=np.intp), 0)
        rest = JointState(0.0, robot.home, np.zeros(robot.n))
        self.update(posture, rest, pairs, Goal(posture.T_base_tool), Params(), 0.01)
        self.reset()

    def brake(self, joints: JointState, dt: float) -> Command:
        """As fast to rest as the acceleration limits allow."""
        return self._braked(joints, dt, "")

    def _braked(self, joints: JointState, dt: float, reason: str) -> Command:
        box = velocity_box(self._robot, joints.q, 1.0, dt)
        qd, _ = bring_into(np.zeros(self._robot.n), self.previous, box)
        self.previous, self._eased[:] = qd, 0.0
        return Command(qd=freeze(qd.copy()), reason=reason)

    def _rows(
        self,
        posture: Posture,
        pairs: Pairs,
        params: Params,
        low: Array,
        high: Array,
    ) -> Rows:
        """The bounds that matter within the box, the world's first."""
        near = avoidance_rows(self._robot, posture, pairs, params, pairs.approach)
        near = that_can_bite(near, low, high)
        gaps = self._clearance.measure(posture, SELF_WITHIN)
        if len(gaps.distance) == 0:
            return near
        own = that_can_bite(own_rows(self._robot, posture, gaps, params), low, high)
        return joined(near, own) if len(own.low) else near

    def _in_force(self, joints: JointState) -> Array:
        """The last command, or what the arm really does where it does not follow."""
        if np.abs(joints.qd - self.previous).max() > ASTRAY:
            return joints.qd
        return self.previous

    def _box(
        self, joints: JointState, speed: float, dt: float, previous: Array
    ) -> tuple[Array, Array]:
        """What the joints may do next; where limits contradict each other, position wins."""
        box = velocity_box(self._robot, joints.q, speed, dt, previous)
        low = np.minimum(np.maximum(box.low, previous - box.change), box.high)
        high = np.maximum(np.minimum(box.high, previous + box.change), box.low)
        return low, np.maximum(low, high)

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
        for stage in self._eased:  # a goal that jumps is no step of the arm's speed
            stage += min(dt / EASE, 1.0) * (twist - stage)
            twist = stage.copy()
        mu = manipulability(tool)
        lost = max(0.0, 1.0 - mu / SINGULAR)
        push = np.zeros(len(previous))
        if mu < 2.0 * SINGULAR and goal is not None:
            push = PUSH * manipulability_gradient(posture, mu)
        return Costs(
            tool, twist, previous, push, params.k_g, params.k_b,
            LAMBDA_Q + LAMBDA_SINGULAR * lost * lost, LAMBDA_A, params.slide,
        )  # fmt: skip
