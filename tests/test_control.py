"""Task priority, activation and the limits that always hold."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.config import Params
from app.control.goals import goal_error, goal_twist
from app.control.limits import MARGIN, bring_into, velocity_box
from app.control.task_priority import ETA, Task, largest_step, solve
from app.control.task_priority_controller import activation
from app.messages import Goal, JointState, Pairs
from app.robot.arm import SimulatedArm
from tests.alone import alone

FREE = np.full(6, 100.0)


def pairs_at(link, point, normal, distance):
    on_robot = np.array(point, dtype=float)
    n = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    return Pairs(
        np.array([link]), np.array([distance]), on_robot[None], (on_robot - distance * n)[None],
        n[None], np.array([0]), 0,
    )  # fmt: skip


NOTHING = Pairs(
    np.array([3]), np.array([np.inf]), np.full((1, 3), np.nan), np.full((1, 3), np.nan),
    np.full((1, 3), np.nan), np.array([-1]), -1,
)  # fmt: skip


# --- the recursion ------------------------------------------------------------------------


@pytest.mark.parametrize("a", [0.0, 0.25, 0.5, 0.75, 0.9, 1.0])
def test_a_fading_row_above_a_full_goal_executes_the_known_share(a):
    omega = (1 - a) ** 2 / ((1 - a) ** 2 + ETA * a**2) if a < 1 else 0.0
    share = a**2 * (1 - omega)
    tasks = [
        Task(np.array([[1.0, 0.0]]), np.array([1.0]), np.array([a])),
        Task(np.eye(2), np.array([0.0, 1.0]), np.ones(2)),
        Task(np.eye(2), np.zeros(2), np.ones(2)),
    ]
    rho, _ = solve(tasks, np.full(2, 100.0))
    assert rho == pytest.approx([share, 1.0], abs=1e-3)


def goal_of(robot, q, rng):
    J = robot.posture(q).tool_jacobian()
    return Task(J, rng.normal(scale=0.1, size=6), np.ones(6))


def row_of(robot, q, rng, a, reference):
    posture = robot.posture(q)
    link = int(rng.integers(3, 7))
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    point = posture.T_base_link[link, :3, 3] + rng.uniform(-0.1, 0.1, 3)
    J = posture.distance_rows(np.array([link]), point[None], normal[None])
    return Task(J, np.array([reference]), np.array([a]))


def test_an_inactive_row_leaves_the_goal_alone(robot):
    rng = np.random.default_rng(20)
    for _ in range(50):
        q = rng.uniform(-2, 2, 6)
        goal = goal_of(robot, q, rng)
        alone, _ = solve([goal], FREE)
        both, _ = solve([row_of(robot, q, rng, 0.0, 0.3), goal], FREE)
        assert np.allclose(alone, both, atol=1e-9)


def test_an_active_row_is_met_exactly_whatever_the_goal_wants(robot):
    rng = np.random.default_rng(21)
    met = 0
    for _ in range(200):
        q = rng.uniform(-2, 2, 6)
        row = row_of(robot, q, rng, 1.0, 0.2)
        if np.linalg.norm(row.jacobian) < 0.2:
            continue
        rho, _ = solve([row, goal_of(robot, q, rng)], FREE)
        assert float(row.jacobian[0] @ rho) == pytest.approx(0.2, abs=1e-6)
        met += 1
    assert met > 100


def test_the_solution_is_continuous_while_a_row_is_switched_on(robot):
    rng = np.random.default_rng(22)
    q = robot.home
    goal, row = goal_of(robot, q, rng), row_of(robot, q, rng, 1.0, 0.2)
    path = np.array([
        solve([replace(row, activation=np.array([a])), goal], FREE)[0]
        for a in np.linspace(0.0, 1.0, 1001)
    ])  # fmt: skip
    span = np.ptp(path, axis=0).max()
    assert np.abs(np.diff(path, axis=0)).max() < 0.02 * span


def test_no_level_pushes_a_joint_over_its_limit_and_the_higher_one_is_kept(robot):
    rng = np.random.default_rng(23)
    limit = np.full(6, 0.5)
    for _ in range(200):
        q = rng.uniform(-3, 3, 6)
        row = row_of(robot, q, rng, 1.0, 0.05)
        first, _ = solve([row], limit)
        goal = goal_of(robot, q, rng)
        both, scale = solve([row, replace(goal, reference=100.0 * goal.reference)], limit)
        assert (np.abs(both) <= limit + 1e-12).all() and 0.0 <= scale <= 1.0
        if np.linalg.norm(row.jacobian) > 0.2:
            assert row.jacobian[0] @ both == pytest.approx(row.jacobian[0] @ first, abs=1e-6)


def test_the_largest_step_stops_at_the_first_joint_that_is_full():
    limit = np.ones(3)
    assert largest_step(np.zeros(3), np.array([0.5, -0.5, 0.0]), limit) == 1.0
    assert largest_step(np.array([0.5, 0.0, 0.0]), np.array([1.0, 1.0, 0.0]), limit) == 0.5
    assert largest_step(np.ones(3), np.array([1.0, 0.0, 0.0]), limit) == 0.0


def test_singular_postures_give_finite_bounded_commands(robot):
    q = np.zeros(6)  # stretched out: elbow and wrist singular
    goal = Task(robot.posture(q).tool_jacobian(), np.full(6, 0.3), np.ones(6))
    rho, _ = solve([goal], robot.qd_max)
    assert np.isfinite(rho).all() and (np.abs(rho) <= robot.qd_max + 1e-12).all()


# --- activation, goal, avoidance ----------------------------------------------------------


def test_activation_is_one_at_d_min_zero_at_the_end_and_smooth_between():
    assert activation(-1.0, 0.2, 0.1) == activation(0.2, 0.2, 0.1) == 1.0
    assert activation(0.3, 0.2, 0.1) == activation(np.inf, 0.2, 0.1) == 0.0
    assert activation(0.25, 0.2, 0.1) == pytest.approx(0.5)


def test_the_goal_twist_is_bounded_and_keeps_its_direction(robot):
    T = robot.posture(robot.home).T_base_tool
    G = T.copy()
    G[:3, 3] += [3.0, 4.0, 0.0]
    assert goal_twist(T, G, 0.3, 0.6)[:3] == pytest.approx([0.18, 0.24, 0.0])
    assert goal_error(T, G)[0] == pytest.approx(5.0)


def test_the_arm_gives_way_along_the_normal_even_against_its_goal(robot):
    posture = robot.posture(robot.home)
    control = alone(robot, "paper")
    normal = np.array([-1.0, 0.0, 0.0])
    point = posture.T_base_tool[:3, 3]
    goal_T = posture.T_base_tool.copy()
    goal_T[0, 3] += 0.5  # straight through the obstacle
    near = pairs_at(6, point, normal, 0.15)
    state = JointState(0.0, robot.home, np.zeros(6))
    params = Params()
    for _ in range(200):  # past the acceleration limit
        command = control.update(posture, state, near, Goal(goal_T), params, 0.004)
    J = posture.distance_rows(near.link, near.on_robot, near.normal)
    assert J[0] @ command.qd == pytest.approx(2.0 * (0.3 - 0.15), abs=1e-6)
    assert command.activation == 1.0 and command.control_row == 0


def test_a_link_that_cannot_move_is_passed_over_for_the_next_one(robot):
    posture = robot.posture(robot.home)
    tool = posture.T_base_tool[:3, 3]
    pairs = Pairs(
        np.array([0, 6]), np.array([0.05, 0.22]),
        np.stack([np.zeros(3), tool]), np.stack([[0.05, 0, 0], tool + np.array([0.22, 0, 0])]),
        np.array([[-1.0, 0, 0], [-1.0, 0, 0]]), np.array([0, 1]), 0,
    )  # fmt: skip
    state = JointState(0.0, robot.home, np.zeros(6))
    command = alone(robot, "wb").update(posture, state, pairs, None, Params(), 0.004)
    assert command.control_row == 1 and command.activation > 0.5


# --- limits -------------------------------------------------------------------------------


@pytest.mark.parametrize("steps", [3000, pytest.param(30_000, marks=pytest.mark.slow)])
def test_limits_are_never_exceeded_in_thousands_of_random_steps(robot, steps):
    rng = np.random.default_rng(24)
    control, dt = alone(robot, "wb"), 0.004
    arm = SimulatedArm(robot, rng.uniform(robot.q_min, robot.q_max))
    params, pairs, goal = Params(joint_speed=1.0), NOTHING, None
    change = 0.0
    before = np.zeros(6)
    for i in range(steps):
        if i % 50 == 0:  # a new, wild situation
            wild = robot.posture(rng.uniform(robot.q_min, robot.q_max))
            goal = Goal(wild.T_base_tool) if rng.random() < 0.9 else None
            if rng.random() < 0.7:
                pairs = pairs_at(
                    int(rng.integers(1, 7)), rng.uniform(-1, 1, 3), rng.normal(size=3),
                    float(rng.uniform(-0.05, 0.35)),
                )  # fmt: skip
            else:
                pairs = NOTHING
            params = Params(
                joint_speed=float(rng.uniform(0.05, 1.0)), goal_speed=1.0, goal_turning=2.0
            )  # fmt: skip
            control = alone(robot, str(rng.choice(["wb", "paper"])))
            control.reset(before)
            dt = float(rng.choice([0.002, 0.004, 0.02]))
        state = arm.state(i * dt)
        command = control.update(robot.posture(state.q), state, pairs, goal, params, dt)
        arm.send(command.qd, dt)
        assert (np.abs(command.qd) <= robot.qd_max).all()
        after = arm.state(0.0)
        assert (after.q >= robot.q_min).all() and (after.q <= robot.q_max).all()
        assert (np.abs(after.qd) <= robot.qd_max).all()
        change = max(change, float((np.abs(after.qd - before) - robot.qdd_max * dt).max()))
        before = after.qd
    assert change <= 1e-9


@settings(max_examples=200)
@given(
    st.lists(st.floats(-7, 7), min_size=6, max_size=6),
    st.lists(st.floats(-5, 5), min_size=6, max_size=6),
    st.lists(st.floats(-3, 3), min_size=6, max_size=6),
)
def test_a_command_is_brought_into_the_box_from_anywhere(robot, q, wanted, previous):
    box = velocity_box(robot, np.array(q), 0.7, 0.004)
    qd, share = bring_into(np.array(wanted), np.array(previous), box)
    assert (box.low <= box.high).all()
    assert (qd >= box.low).all() and (qd <= box.high).all() and 0.0 <= share <= 1.0
    assert (np.abs(qd) <= 0.7 * robot.qd_max).all()


def test_a_joint_at_its_end_does_not_hold_the_others(robot):
    q = robot.home.copy()
    q[2] = robot.q_max[2] - MARGIN
    box = velocity_box(robot, q, 1.0, 0.1)
    qd, _ = bring_into(np.array([0.1, 0.0, 0.3, 0.0, 0.0, 0.0]), np.zeros(6), box)
    assert qd[2] == pytest.approx(0.0) and qd[0] == pytest.approx(0.1)


def test_an_arm_that_starts_outside_its_range_is_brought_back(robot):
    q = robot.home.copy()
    q[2] = robot.q_max[2] + 0.1
    box = velocity_box(robot, q, 1.0, 0.004)
    assert box.high[2] < 0.0


def test_braking_comes_to_rest_within_the_acceleration_limit(robot):
    control = alone(robot, "wb")
    posture = robot.posture(robot.home)
    away = Goal(robot.posture(robot.home + 0.5).T_base_tool)
    state = JointState(0.0, robot.home, np.zeros(6))
    for _ in range(100):
        last = control.update(posture, state, NOTHING, away, Params(), 0.004).qd
    steps = 0
    while np.abs(last).max() > 0:
        now = control.brake(state, 0.004)
        assert (np.abs(now - last) <= robot.qdd_max * 0.004 + 1e-12).all()
        last, steps = now, steps + 1
    assert 0 < steps < 200


def test_the_simulated_arm_refuses_a_command_that_is_not_finite(robot):
    with pytest.raises(ValueError, match="non-finite"):
        SimulatedArm(robot).send(np.array([np.nan] * 6), 0.004)
