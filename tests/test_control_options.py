"""What may be chosen: slow and stop only, strict order of bounds, more levels of priority."""

import numpy as np
import pytest

from app.config import Params
from app.control.bounds.rows import Rows
from app.control.limit_task import NEAR, limit_task
from app.control.qp import Costs, least_slack, solve
from app.control.separation import allowed_speed
from app.messages import Goal, JointState, Pairs
from app.robot.arm import SimulatedArm
from tests.alone import alone

DT = 0.01
NOTHING = Pairs(
    np.empty(0, dtype=np.intp), np.empty(0), *[np.empty((0, 3))] * 3, np.empty(0, dtype=np.intp), -1
)


@pytest.fixture(scope="module")
def bounds(robot):
    return alone(robot, "ssm")


def ahead(posture, wall):
    """The tool's origin and a wall at x = `wall` [m]."""
    on = posture.T_base_tool[None, :3, 3].copy()
    d = np.array([wall - on[0, 0]])
    n = np.array([[-1.0, 0.0, 0.0]])
    return Pairs(np.array([6]), d, on, on - d[:, None] * n, n, np.zeros(1, dtype=np.intp), 0)


def drive(robot, control, params, goal, seconds, pairs=lambda posture: NOTHING):
    """Joint states over time."""
    arm, states = SimulatedArm(robot), []
    for i in range(int(seconds / DT)):
        states.append(arm.state(i * DT))
        posture = robot.posture(states[-1].q)
        command = control.update(posture, states[-1], pairs(posture), goal, params, DT)
        arm.send(command.qd, DT)
    return states


def test_slow_and_stop_approaches_no_faster_than_allowed_and_never_gives_way(robot, bounds):
    params = Params(mode="ssm", joint_speed=1.0, goal_speed=1.0)
    start = robot.posture(robot.home).T_base_tool
    goal = start.copy()
    goal[0, 3] += 0.3
    wall = start[0, 3] + 0.8
    bounds.reset()
    states = drive(robot, bounds, params, Goal(goal), 4.0, lambda p: ahead(p, wall))
    x = np.array([robot.posture(s.q).T_base_tool[0, 3] for s in states])
    speed = np.diff(x) / DT
    allowed = allowed_speed(wall - x[:-1], params)
    assert speed.max() > 0.2 and (speed <= allowed + 0.03).all()
    bounds.reset()
    near = drive(robot, bounds, params, Goal(start), 2.0, lambda p: ahead(p, start[0, 3] + 0.05))
    assert np.abs(near[-1].q - robot.home).max() < 1e-6  # it would have retreated as qp


def opposite(robot, cheap, dear):
    """A bound that asks the first joint one way at a price, and one that asks it the other."""
    J = np.zeros((2, robot.n))
    J[:, 0] = 1.0, -1.0
    z = np.zeros(2)
    rows = Rows(J, np.array([0.2, 0.1]), np.array([cheap, dear]), np.full(2, 100.0), z, z)
    tool = robot.posture(robot.home).tool_jacobian()
    n = robot.n
    costs = Costs(tool, np.zeros(6), np.zeros(n), np.zeros(n), 10.0, 0.5, 1e-3, 2e-3, False)
    return costs, rows


def test_in_strict_order_the_slack_is_the_least_that_exists(robot):
    costs, rows = opposite(robot, 1e-3, 1e-3)  # bounds that are cheaper to break than the goal
    box = np.ones(robot.n)
    assert least_slack(rows, -box, box) == pytest.approx([0.15, 0.15], abs=1e-4)
    loose = solve(costs, rows, -box, box)
    strict = solve(costs, rows, -box, box, lexicographic=True)
    assert (strict.slack**2).sum() < (loose.slack**2).sum() - 1e-6
    assert strict.slack == pytest.approx([0.15, 0.15], abs=1e-3)


def test_strict_order_reaches_what_the_prices_reach_where_the_bounds_can_be_met(robot):
    rng = np.random.default_rng(4)
    box = np.ones(robot.n)
    for _ in range(50):
        J, inside = rng.normal(size=(8, robot.n)), rng.uniform(-0.3, 0.3, robot.n)
        z = np.zeros(8)
        rows = Rows(J, J @ inside - 0.05, np.full(8, 50.0), np.full(8, 100.0), z, z)
        tool = robot.posture(rng.uniform(-2, 2, robot.n)).tool_jacobian()
        n = robot.n
        twist = rng.normal(scale=0.2, size=6)
        costs = Costs(tool, twist, np.zeros(n), np.zeros(n), 10.0, 0.5, 1e-3, 2e-3, False)
        one, two = solve(costs, rows, -box, box), solve(costs, rows, -box, box, lexicographic=True)
        assert two.slack.max() < 1e-4 and two.qd == pytest.approx(one.qd, abs=1e-2)


def test_the_level_of_the_limits_fades_in_and_leads_away(robot):
    middle = limit_task(robot, 0.5 * (robot.q_min + robot.q_max))
    assert not middle.activation.any()
    q = robot.home.copy()
    q[2] = robot.q_max[2] - 0.5 * NEAR
    task = limit_task(robot, q)
    assert 0.0 < task.activation[2] < 1.0 and task.reference[2] < 0.0
    q[2] = robot.q_min[2] + 0.01
    task = limit_task(robot, q)
    assert task.activation[2] == 1.0 and task.reference[2] > 0.0


def test_with_the_level_a_joint_leaves_its_end_though_the_goal_asks_for_it(robot):
    at_end = robot.home.copy()
    at_end[2] = robot.q_max[2] - 0.03
    posture, state = robot.posture(at_end), JointState(0.0, at_end, np.zeros(robot.n))
    further = at_end.copy()
    further[2] += 0.02
    goal = Goal(robot.posture(further).T_base_tool)
    with_it, without = (
        alone(robot, "wb").update(posture, state, NOTHING, goal, Params(limits_first=on), DT).qd[2]
        for on in (True, False)
    )
    assert with_it < 0.0 < without


def test_position_goes_before_orientation_where_both_cannot_be_had(robot):
    """The goal's place is in reach, its direction there is not."""
    goal = robot.posture(robot.home).T_base_tool.copy()
    goal[:3, 3] = [1.15, 0.2, 0.5]
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    goal[:3, :3] = turn @ turn @ goal[:3, :3]

    def miss(split):
        params = Params(position_first=split)
        states = drive(robot, alone(robot, "wb"), params, Goal(goal), 15.0)
        reached = robot.posture(states[-1].q).T_base_tool[:3, 3]
        speed = np.abs(np.array([s.qd for s in states]))
        assert (speed <= robot.qd_max + 1e-9).all()
        return float(np.linalg.norm(reached - goal[:3, 3]))

    assert miss(True) < miss(False) - 0.01
