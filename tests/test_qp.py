"""The quadratic programme: what it reaches, what it keeps, and that it always has an answer."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.cell.parts import Box, Cell
from app.config import Params
from app.control import qp_controller
from app.control.bounds.pairs import PairBounds
from app.control.bounds.rows import Rows
from app.control.capsules import fit_capsules
from app.control.clearance import Clearance
from app.control.gaps import KEPT
from app.control.goals import goal_error
from app.control.limits import velocity_box
from app.control.manipulability import manipulability, manipulability_gradient
from app.control.qp import Costs, solve
from app.errors import FlinchError
from app.messages import Goal, JointState, Pairs
from app.robot.arm import SimulatedArm
from tests.alone import alone, bound_by

QP = Params(mode="qp")


@pytest.fixture(scope="module")
def whole_body(robot):
    return alone(robot)


@pytest.fixture
def control(whole_body):
    whole_body.reset()
    return whole_body


def pairs_of(links, points, normals, distances):
    n = np.asarray(normals, float).reshape(-1, 3)
    d, on = np.asarray(distances, float), np.array(points, float).reshape(-1, 3)
    slot = np.arange(len(d))
    closest = int(np.argmin(d)) if len(d) else -1
    return Pairs(np.asarray(links, np.intp), d, on, on - d[:, None] * n, n, slot, closest)


NOTHING = pairs_of([], [], [], [])


def rows_of(jacobian, low):
    m = len(low)
    return Rows(
        np.asarray(jacobian, float), np.asarray(low, float), np.full(m, 50.0), np.full(m, 100.0),
        np.arange(m), np.zeros(m, dtype=int),
    )  # fmt: skip


def costs_of(robot, q, twist):
    tool = robot.posture(q).tool_jacobian()
    n = robot.n
    return Costs(tool, twist, np.zeros(n), np.zeros(n), 10.0, 0.5, 1e-3, 2e-3, True)


def wall_before(posture, robot, x):
    """Exact pairs of the links' origins with the plane at `x`, robot on its near side."""
    origins = posture.T_base_link[1:, :3, 3]
    n = np.tile([-1.0, 0.0, 0.0], (len(origins), 1))
    return pairs_of(np.arange(1, len(robot.links)), origins, n, x - origins[:, 0])


# --- the problem --------------------------------------------------------------------------


def test_without_bounds_it_is_damped_least_squares(robot):
    rng = np.random.default_rng(1)
    free = np.full(6, 50.0)
    for _ in range(20):
        c = costs_of(robot, rng.uniform(-2, 2, 6), rng.normal(scale=0.1, size=6))
        W = np.diag([1, 1, 1, 0.3, 0.3, 0.3])
        H = 10.0 * c.tool.T @ W @ c.tool + 3e-3 * np.eye(6)
        expected = np.linalg.solve(H, 10.0 * c.tool.T @ W @ c.twist)
        got = solve(c, rows_of(np.zeros((0, 6)), []), -free, free)
        assert got.qd == pytest.approx(expected, abs=1e-4)


def test_opposite_bounds_share_the_pain_and_are_solved(robot):
    n = np.array([1.0, 0, 0, 0, 0, 0])
    c = costs_of(robot, robot.home, np.zeros(6))
    got = solve(c, rows_of([n, -n], [1.0, 1.0]), -np.ones(6), np.ones(6))
    assert got is not None and got.slack.sum() == pytest.approx(2.0, abs=1e-3)
    assert np.isfinite(got.slack).all() and abs(got.qd[0]) <= 1.0


def test_every_answer_is_the_minimum_within_narrow_boxes(robot):
    """A box that is far from the optimum: the solver alone would take the wrong end of it."""
    rng = np.random.default_rng(5)
    W = np.diag([1, 1, 1, 0.3, 0.3, 0.3])

    def cost(qd, c, rows):
        s = np.maximum(rows.low - rows.jacobian @ qd, 0.0)
        miss = c.tool @ qd - c.twist
        return 5.0 * miss @ W @ miss + 1.5e-3 * qd @ qd + (50.0 * s + 50.0 * s * s).sum()

    for k in range(300):
        q, m = rng.uniform(-2, 2, 6), int(rng.integers(0, 9))
        c = costs_of(robot, q, rng.normal(scale=0.3, size=6))
        rows = rows_of(rng.normal(scale=0.4, size=(m, 6)), rng.uniform(-0.8, 0.1, m))
        middle = rng.uniform(-0.3, 0.3, 6)
        low, high = middle - 0.024, middle + 0.024
        got = solve(c, rows, low, high)
        best = cost(got.qd, c, rows)
        for other in rng.uniform(low, high, (50, 6)):
            assert best <= cost(other, c, rows) + 1e-4, k
        for share in (0.01, 0.1):  # and it cannot be improved by a step to any corner
            for corner in rng.integers(0, 2, (50, 6)):
                to = np.where(corner, high, low)
                assert best <= cost(got.qd + share * (to - got.qd), c, rows) + 1e-4, k


def test_slack_is_zero_wherever_the_bounds_can_be_met(robot):
    rng = np.random.default_rng(2)
    worst = 0.0
    for _ in range(100):
        J, qd = rng.normal(size=(10, 6)), rng.uniform(-0.5, 0.5, 6)
        c = costs_of(robot, rng.uniform(-2, 2, 6), rng.normal(scale=0.2, size=6))
        got = solve(c, rows_of(J, J @ qd - 0.01), -np.ones(6), np.ones(6))
        worst = max(worst, got.slack.max(), float((J @ qd - 0.01 - J @ got.qd).max()))
    assert worst < 1e-3


@pytest.mark.parametrize("m", [12, 32])
def test_new_rows_in_every_tick_are_all_solved(robot, m):
    rng = np.random.default_rng(3)
    for _ in range(500):
        c = costs_of(robot, rng.uniform(-2, 2, 6), rng.normal(scale=0.2, size=6))
        rows = rows_of(rng.normal(scale=0.4, size=(m, 6)), rng.uniform(-0.8, 0.3, m))
        assert solve(c, rows, -np.ones(6), np.ones(6)) is not None


def test_manipulability_has_the_gradient_of_finite_differences(robot):
    rng = np.random.default_rng(4)

    def mu(q):
        return manipulability(robot.posture(q).tool_jacobian())

    for _ in range(10):
        q = rng.uniform(-2, 2, 6)
        e = 1e-6 * np.eye(6)
        slope = [(mu(q + d) - mu(q - d)) / 2e-6 for d in e]
        assert manipulability_gradient(robot.posture(q), mu(q)) == pytest.approx(slope, abs=1e-7)


# --- the bounds ---------------------------------------------------------------------------


def of_the_world(robot, posture, pairs, params):
    """As wide as can be: nothing is left out because it cannot be broken, nothing is eased in."""
    return bound_by(robot, PairBounds(), posture, pairs, params)


def bound(robot, distance, w=0.0, **changes):
    posture = robot.posture(robot.home)
    tool = posture.T_base_tool[:3, 3]
    pairs = pairs_of([6], [tool], [[-1.0, 0.0, 0.0]], [distance])
    pairs = replace(pairs, approach=np.array([w]))
    rows = of_the_world(robot, posture, pairs, Params(mode="qp", **changes))
    return float(rows.low[0]) if len(rows.low) else None


def test_a_bound_lets_approach_fade_to_nothing_at_d_s(robot):
    assert bound(robot, 0.60) is None
    assert bound(robot, 0.25) == pytest.approx(0.0)
    assert bound(robot, 0.30) == pytest.approx(-0.05 / 0.35)
    assert bound(robot, 0.20) == pytest.approx(0.05 / 0.35)
    assert bound(robot, -0.50, joint_speed=1.0) == pytest.approx(0.5)  # v_esc
    assert 0.0 < bound(robot, 0.15) < 0.25  # a share of what the joints can do
    assert 0.25 < bound(robot, 0.05) <= 0.5  # what is close may ask for more


def test_an_obstacle_that_comes_tightens_the_bound_and_one_that_goes_does_not_loosen_it(robot):
    assert bound(robot, 0.4, 0.3) == pytest.approx(bound(robot, 0.4) + 0.3)
    assert bound(robot, 0.4, -0.2) == bound(robot, 0.4)


def test_the_tightest_rows_are_kept_when_there_are_too_many(robot):
    posture = robot.posture(robot.home)
    d = np.linspace(0.59, 0.2, 40)
    tool = np.tile(posture.T_base_tool[:3, 3], (40, 1))
    pairs = pairs_of(np.full(40, 6), tool, np.tile([-1.0, 0, 0], (40, 1)), d)
    rows = of_the_world(robot, posture, pairs, QP)
    assert len(rows.low) == 24 and set(rows.source) == set(range(16, 40))


def test_a_point_that_can_hardly_be_moved_is_led_away_only_from_what_is_close(robot):
    posture = robot.posture(robot.home)
    arm = posture.T_base_link[robot.link_index("upper_arm_link")]
    tool = posture.T_base_tool[:3, 3]
    along = tool[:2] / np.linalg.norm(tool[:2])
    side = np.array([[-along[1], along[0], 0.0]])  # the way that only the first joint moves it
    on = arm[None, :3, 3] + 0.17 * np.append(along, 0.0)

    def low(distance):
        link = robot.link_index("upper_arm_link")
        rows = of_the_world(robot, posture, pairs_of([link], on, side, [distance]), QP)
        return float(rows.low[0]), float(np.abs(rows.jacobian[0]) @ (QP.joint_speed * robot.qd_max))

    (far, reach), (near, _), (closest, _) = low(0.20), low(0.07), low(0.03)
    assert 0.15 < reach < 0.30 and far < 0.0
    assert 0.0 < near < closest == pytest.approx(0.5 * reach)


# --- the arm itself and the cell ----------------------------------------------------------


def test_capsules_hold_every_vertex_of_the_bodies(robot):
    c = fit_capsules(robot.bodies)
    for i, body in enumerate(robot.bodies):
        gaps = []
        for k in np.flatnonzero(c.link == i):
            u = c.b[k] - c.a[k]
            t = np.clip((body.vertices - c.a[k]) @ u / max(u @ u, 1e-12), 0.0, 1.0)
            foot = c.a[k] + t[:, None] * u
            gaps.append(np.linalg.norm(body.vertices - foot, axis=1) - c.radius[k])
        assert np.min(gaps, axis=0).max() < 1e-6


def test_neighbours_are_no_pair_and_the_wrist_is_kept_from_the_upper_arm(robot):
    pairs = {(robot.links[a], robot.links[b]) for a, b in Clearance(robot).pairs}
    assert ("upper_arm_link", "wrist_3_link") in pairs
    assert ("upper_arm_link", "forearm_link") not in pairs
    assert ("wrist_1_link", "wrist_3_link") not in pairs


def test_the_distance_to_a_box_of_the_cell_is_that_of_the_capsules(robot):
    posture = robot.posture(robot.home)
    T = np.eye(4)
    T[:3, 3] = posture.T_base_link[6, :3, 3] + [0.5, 0.0, 0.0]
    post = Cell(boxes=(Box("post", T, np.array([0.2, 2.0, 2.0])),))
    gaps = Clearance(robot, post).measure(posture, 0.6)
    cell = gaps.b == -1
    wrist = (gaps.a == 6) & cell
    assert wrist.sum() == 1 and gaps.normal[wrist][0] == pytest.approx([-1.0, 0.0, 0.0], abs=1e-6)
    assert gaps.distance[wrist][0] == pytest.approx(0.4 - 0.05, abs=0.02)
    assert (gaps.on_b[wrist][0] - gaps.on_a[wrist][0])[0] == pytest.approx(gaps.distance[wrist][0])


def test_the_arm_does_not_run_into_itself_or_the_table(robot):
    T = np.eye(4)
    T[2, 3] = -0.05
    table = Cell(boxes=(Box("table", T, np.array([2.0, 2.0, 0.1])),))
    control, clearance = alone(robot, "qp", table), Clearance(robot, table)
    for place in ([0.15, 0.1, -0.3], [0.6, 0.3, -0.2]):  # beside the base, and out on the table
        goal = robot.posture(robot.home).T_base_tool.copy()
        goal[:3, 3] = place
        arm = SimulatedArm(robot)
        control.reset()
        least = np.inf
        for i in range(1500):
            state = arm.state(i * 0.01)
            posture = robot.posture(state.q)
            arm.send(control.update(posture, state, NOTHING, Goal(goal), QP, 0.01).qd, 0.01)
            least = min(least, clearance.measure(posture, 0.2).distance.min(initial=1.0))
        assert 0.0 < least < KEPT + 0.01


# --- the controller -----------------------------------------------------------------------


def test_it_reaches_a_goal_and_rests_there(robot, control):
    arm = SimulatedArm(robot)
    goal = robot.posture(robot.home + np.array([0.3, 0.2, -0.2, 0.1, 0.1, 0.2])).T_base_tool
    for i in range(1200):
        s = arm.state(i * 0.01)
        arm.send(control.update(robot.posture(s.q), s, NOTHING, Goal(goal), QP, 0.01).qd, 0.01)
    distance, angle = goal_error(robot.posture(arm.state(0.0).q).T_base_tool, goal)
    assert distance < 1e-3 and angle < 2e-3 and np.abs(arm.state(0.0).qd).max() < 1e-3


@pytest.mark.parametrize("speed", [0.1, 0.3])
def test_a_plane_that_is_seen_perfectly_is_kept_at_d_s(robot, control, speed):
    params = Params(mode="qp", goal_speed=speed)
    arm = SimulatedArm(robot, lag=0.0)
    goal = robot.posture(robot.home).T_base_tool.copy()
    wall = robot.posture(robot.home).T_base_link[1:, 0, 3].max() + 0.45
    goal[0, 3] = wall + 0.05
    least = np.inf
    for i in range(2000):
        s = arm.state(i * 0.004)
        posture = robot.posture(s.q)
        pairs = wall_before(posture, robot, wall)
        least = min(least, pairs.minimum)
        arm.send(control.update(posture, s, pairs, Goal(goal), params, 0.004).qd, 0.004)
    assert params.distance_kept - 0.002 <= least < params.distance_kept + 0.03


def test_moving_away_is_free(robot, control):
    posture = robot.posture(robot.home)
    s = JointState(0.0, robot.home, np.zeros(6))
    goal = posture.T_base_tool.copy()
    goal[0, 3] -= 0.2
    wall = posture.T_base_link[1:, 0, 3].max() + 0.27
    for _ in range(60):
        free = control.update(posture, s, NOTHING, Goal(goal), QP, 0.02).qd
    control.reset()
    for _ in range(60):
        near = control.update(posture, s, wall_before(posture, robot, wall), Goal(goal), QP, 0.02)
    assert near.qd == pytest.approx(free, abs=2e-3) and near.activation == 0.0


def test_a_change_of_the_closest_pair_does_not_move_the_command(robot, control):
    posture = robot.posture(robot.home)
    s = JointState(0.0, robot.home, np.zeros(6))
    points = [posture.T_base_link[4, :3, 3], posture.T_base_link[6, :3, 3]]
    normals = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]

    def settled(e):
        control.reset()
        for _ in range(60):
            pairs = pairs_of([3, 6], points, normals, [0.22 - e, 0.22 + e])
            c = control.update(posture, s, pairs, Goal(posture.T_base_tool), QP, 0.02)
        return c.qd

    assert np.abs(settled(1e-5) - settled(-1e-5)).max() < 1e-3


def test_an_unsolved_tick_brakes_with_a_reason_and_three_stop(robot, control, monkeypatch):
    posture = robot.posture(robot.home)
    s = JointState(0.0, robot.home, np.zeros(6))
    away = Goal(robot.posture(robot.home + 0.5).T_base_tool)
    for _ in range(50):
        before = control.update(posture, s, NOTHING, away, QP, 0.004)
    monkeypatch.setattr(qp_controller, "solve", lambda *_: None)
    for _ in range(2):
        c = control.update(posture, s, NOTHING, away, QP, 0.004)
        assert "no solution" in c.reason and np.abs(c.qd).max() < np.abs(before.qd).max()
        assert (np.abs(c.qd - before.qd) <= robot.qdd_max * 0.004 + 1e-12).all()
        before = c
    with pytest.raises(FlinchError, match="three times"):
        control.update(posture, s, NOTHING, away, QP, 0.004)


# --- whatever comes in, a bounded command goes out -----------------------------------------

number = st.floats(-1.0, 1.0)
vector = st.tuples(number, number, number)
threat = st.tuples(
    st.integers(0, 6), vector, vector, st.sampled_from([0.0, 1e-9, -0.05, 0.1, 0.25, 0.5, 5.0])
)
joints = st.one_of(
    st.just((0.0,) * 6),  # stretched out: singular
    st.just((0.0, -1.57, 0.0, -1.57, 0.0, 0.0)),
    st.tuples(*[st.floats(-6.2, 6.2)] * 6),
)


@settings(max_examples=60)
@given(joints, st.lists(threat, max_size=12), vector, st.booleans(), st.integers(1, 3))
def test_any_threats_give_a_finite_bounded_command(
    robot, whole_body, q, threats, goal, run, copies
):
    """Opposite walls, points at no distance, doubled points, goals in obstacles, singularities."""
    whole_body.reset()
    q = np.clip(q, robot.q_min, robot.q_max)
    threats = threats * copies
    normals = [np.array(n) / max(np.linalg.norm(n), 1e-9) for _, _, n, _ in threats]
    normals = [n if np.linalg.norm(n) > 0.5 else np.array([0.0, 0.0, 1.0]) for n in normals]
    posture = robot.posture(q)
    on = [posture.T_base_link[t[0], :3, 3] + 0.1 * np.array(t[1]) for t in threats]
    pairs = pairs_of([t[0] for t in threats], on, normals, [t[3] for t in threats])
    T = posture.T_base_tool.copy()
    T[:3, 3] = goal
    state = JointState(0.0, q, np.zeros(6))
    approach = np.array([t[1][0] for t in threats])
    for c in (whole_body, alone(robot, "wb"), alone(robot, "multi"), alone(robot, "ssm")):
        previous = np.zeros(6)
        for _ in range(3):
            command = c.update(posture, state, pairs, Goal(T) if run else None, QP, 0.004, approach)
            box = velocity_box(robot, q, 1.0, 0.004)
            assert np.isfinite(command.qd).all() and np.isfinite(command.slack)
            assert (command.qd >= box.low).all() and (command.qd <= box.high).all()
            change = np.abs(command.qd - previous)
            asked_back = (box.low > 0.0) | (box.high < 0.0)  # position wins over acceleration
            assert (change[~asked_back] <= robot.qdd_max[~asked_back] * 0.004 + 1e-9).all()
            previous = command.qd


def test_a_command_keeps_every_limit_in_ten_thousand_wild_ticks(robot, control):
    rng = np.random.default_rng(24)
    arm, dt = SimulatedArm(robot), 0.004
    before, excess = np.zeros(6), -np.inf
    for i in range(10_000):
        if i % 25 == 0:
            goal = Goal(robot.posture(rng.uniform(robot.q_min, robot.q_max)).T_base_tool)
            k = int(rng.integers(0, 9))
            n = rng.normal(size=(k, 3))
            n /= np.linalg.norm(n, axis=1)[:, None]
            pairs = pairs_of(
                rng.integers(0, 7, k), rng.uniform(-1, 1, (k, 3)), n, rng.uniform(-0.05, 0.7, k)
            )
            speed = float(rng.uniform(0.05, 1.0))
            params = Params(mode="qp", joint_speed=speed, goal_speed=1.0, goal_turning=2.0)
        s = arm.state(i * dt)
        qd = control.update(robot.posture(s.q), s, pairs, goal, params, dt).qd
        arm.send(qd, dt)
        after = arm.state(0.0)
        excess = max(
            excess,
            float((np.abs(qd) - robot.qd_max).max()),
            float((np.abs(after.qd - before) - robot.qdd_max * dt).max()),
            float((after.q - robot.q_max).max()), float((robot.q_min - after.q).max()),
        )  # fmt: skip
        before = after.qd
    assert excess <= 1e-9
