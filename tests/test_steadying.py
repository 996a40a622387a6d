"""Pairs between frames: noise does not move the arm, danger is believed at once."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.config import Params
from app.control.bounds.pairs import PairBounds
from app.messages import Goal, JointState, Pairs
from app.perception.following import GONE, KEEP, NEARER, ROOM, UNSURE
from app.perception.steadying import Steadying
from tests.alone import alone, bound_by

DT, REACH = 0.008, 0.6


@pytest.fixture(scope="module")
def posture(robot):
    return robot.posture(robot.home)


def pairs_at(posture, *distances, link=6):
    """Pairs of one link with a wall ahead, each on a place of its own."""
    k = len(distances)
    d, n = np.asarray(distances, float), np.tile([-1.0, 0.0, 0.0], (k, 1))
    on = posture.T_base_link[link, :3, 3] + 0.1 * np.arange(k)[:, None] * [0.0, 1.0, 0.0]
    return Pairs(np.full(k, link), d, on, on - d[:, None] * n, n, np.arange(k), 0 if k else -1)


def run(steady, posture, distances, approach=None):
    """The believed distance after each of the measured ones."""
    out = []
    for d in distances:
        w = None if approach is None else np.array([approach])
        rows = steady.update(posture, replace(pairs_at(posture, d), approach=w), REACH, DT)
        out.append(float(rows.distance.min(initial=np.inf)) + UNSURE)
    return np.array(out)


def test_noise_is_averaged_and_its_mean_is_kept(posture):
    rng = np.random.default_rng(1)
    # a frame every eight ticks, as at 15 Hz
    measured = np.repeat(0.3 + rng.normal(scale=0.006, size=300), 8)
    believed = run(Steadying(), posture, measured)[400:]
    assert believed.std() < 0.5 * 0.006 and abs(believed.mean() - 0.3) < 0.003
    assert np.abs(np.diff(believed)).max() < 0.3 * np.abs(np.diff(measured)).max()


def test_what_is_really_nearer_is_believed_at_once(posture):
    believed = run(Steadying(), posture, [0.40] * 5 + [0.25] * 5)
    assert believed[4] == pytest.approx(0.40) and believed[5] <= 0.25 + NEARER + 1e-12


def test_what_comes_is_never_believed_farther_than_measured(posture):
    measured = 0.5 - 0.4 * DT * np.arange(60)
    believed = run(Steadying(), posture, measured, approach=0.4)
    assert (believed <= measured + 1e-12).all()


def test_the_arms_own_motion_is_no_lag(robot):
    """The wall stands, the arm goes: the distance follows without a measurement's delay."""
    steady, q = Steadying(), robot.home.copy()
    wall = robot.posture(q).T_base_link[6, 0, 3] + 0.45
    worst = 0.0
    for _ in range(200):
        q = q + DT * np.array([0.0, 0.3, -0.2, 0.0, 0.0, 0.0])
        posture = robot.posture(q)
        d = wall - posture.T_base_link[6, 0, 3]
        rows = steady.update(posture, pairs_at(posture, d), REACH, DT)
        worst = max(worst, abs(float(rows.distance[0]) + UNSURE - d))
    assert worst < 1e-3


def test_a_pair_that_is_gone_stays_for_a_moment_and_then_recedes_at_a_walk(posture):
    steady = Steadying()
    run(steady, posture, [0.30] * 5)
    nothing = pairs_at(posture)
    seen = [steady.update(posture, nothing, REACH, DT) for _ in range(250)]
    distance = np.array([rows.distance.min(initial=np.inf) for rows in seen]) + UNSURE
    still = int(KEEP / DT) - 1
    assert np.allclose(distance[:still], 0.30) and distance[still + 20] > 0.32
    finite = distance[np.isfinite(distance)]
    assert np.diff(finite).max() < 0.003 and np.isinf(distance[-1])
    assert all((rows.source == -1).all() for rows in seen)


def test_pairs_keep_their_rows_and_two_of_one_link_stay_apart(posture):
    steady = Steadying()
    for _ in range(3):
        rows = steady.update(posture, pairs_at(posture, 0.3, 0.4), REACH, DT)
    source = rows.source
    assert sorted(source.tolist()) == [0, 1]
    assert rows.distance[source == 0] == pytest.approx(0.3 - UNSURE)
    other_way = pairs_at(posture, 0.2, 0.5)
    other_way = replace(
        other_way,
        link=other_way.link[::-1].copy(),
        distance=other_way.distance[::-1].copy(),
        on_robot=other_way.on_robot[::-1].copy(),
        on_world=other_way.on_world[::-1].copy(),
    )
    swapped = steady.update(posture, other_way, REACH, DT).source
    assert swapped.tolist() == source[::-1].tolist()


def test_a_gentle_retreat_is_eased_in_and_an_urgent_one_is_bounded_by_the_arm(robot):
    posture = robot.posture(robot.home)
    params = Params(mode="qp")
    d = params.distance_kept
    for distance, least, most in ((d - 0.02, 0.01, 0.3), (d - 0.1, 1.0, 1.0), (d + 0.1, 0.0, 0.0)):
        pairs = pairs_at(posture, distance)

        def low(previous, pairs=pairs, dt=DT):
            return float(bound_by(robot, PairBounds(), posture, pairs, params, previous, dt).low[0])

        J = posture.distance_rows(pairs.link, pairs.on_robot, pairs.normal)[0]
        step = 0.5 * np.abs(J) @ robot.qdd_max * DT
        still, asked = np.zeros(6), low(np.zeros(6), dt=1e6)
        if most:
            assert least * step <= low(still) * (1 + 1e-9) <= most * step * (1 + 2e-9)
        else:
            assert low(still) == asked < 0.0  # an approach that is allowed is no demand
        fast = asked * J / (J @ J)  # it retreats fast enough already
        assert low(fast) == pytest.approx(asked)


def test_what_is_seen_takes_the_place_of_what_was_lost(robot):
    posture, steady = robot.posture(robot.home), Steadying()
    rng = np.random.default_rng(3)
    link = np.full(ROOM, 6)
    for _ in range(3):  # within a moment many more pairs than can be followed, each elsewhere
        on = posture.T_base_tool[:3, 3] + rng.uniform(-3.0, 3.0, (ROOM, 3))
        n = rng.normal(size=(ROOM, 3))
        n /= np.linalg.norm(n, axis=1)[:, None]
        d = np.full(ROOM, 0.3)
        many = Pairs(link, d, on, on - d[:, None] * n, n, np.arange(ROOM), 0)
        source = steady.update(posture, many, REACH, DT).source
        assert sorted(source.tolist()) == list(range(ROOM))


def test_a_new_goal_is_no_jump_of_the_speed_and_is_reached_all_the_same(robot):
    control, params = alone(robot), Params(mode="qp")
    nothing = pairs_at(robot.posture(robot.home))
    goal = Goal(robot.posture(robot.home + 0.2).T_base_tool)
    qd = [np.zeros(6), np.zeros(6)]
    for _ in range(100):
        here = JointState(0.0, robot.home, qd[-1])
        qd.append(control.update(robot.posture(here.q), here, nothing, goal, params, DT).qd)
    jerk = np.abs(np.diff(qd, n=2, axis=0)).max() / DT**2
    assert jerk < 150.0  # a step of the acceleration within its limit alone would be 750
    assert np.abs(qd[-1]).max() > 0.1


def test_a_lost_pair_far_out_is_forgotten_in_time_though_nothing_is_too_far(posture):
    steady = Steadying()
    steady.update(posture, pairs_at(posture, 1.5), np.inf, DT)
    left = [steady.update(posture, pairs_at(posture), np.inf, DT) for _ in range(700)]
    assert len(left[int((GONE - 0.1) / DT)].distance) == 1
    assert len(left[int((GONE + 0.1) / DT)].distance) == 0


def test_what_is_followed_has_the_age_of_its_measurement_and_what_is_lost_grows_older(posture):
    steady, both = Steadying(), replace(pairs_at(posture, 0.3, 0.4), age=np.array([0.07, 0.11]))
    rows = steady.update(posture, both, REACH, DT)
    assert rows.age[np.argsort(rows.source)] == pytest.approx([0.07, 0.11])
    one = replace(pairs_at(posture, 0.3), age=np.array([0.05]))
    rows = steady.update(posture, one, REACH, DT)
    assert sorted(rows.age) == pytest.approx([0.05, 0.11 + DT])
    assert [rows.measured(row) for row in (-1, *np.argsort(rows.source))] == [-1, -1, 0]


def believed(posture, sigma, age, w, w_sigma, ticks=3):
    """What is told of a pair at 0.4 m that is known so well."""
    steady, (one,) = Steadying(), (pairs_at(posture, 0.4),)
    one = replace(
        one, sigma=np.array([sigma]), age=np.array([age]), approach=np.array([w]),
        approach_sigma=np.array([w_sigma]),
    )  # fmt: skip
    for _ in range(ticks):
        rows = steady.update(posture, one, REACH, DT)
    return rows


DOUBT = {
    "sigma": st.floats(0.0, 0.03), "age": st.floats(0.0, 1.0), "w": st.floats(-0.2, 1.6),
    "w_sigma": st.floats(0.0, 0.3),
}  # fmt: skip


@given(**DOUBT, which=st.sampled_from(list(DOUBT)), more=st.floats(0.0, 0.3))
def test_more_doubt_never_allows_more_speed_towards(robot, posture, which, more, **doubt):
    worse = doubt | {which: doubt[which] + more}
    low, rate = [], []
    for known in (doubt, worse):
        rows = believed(posture, **known)
        low.append(float(bound_by(robot, (PairBounds(),), posture, rows, Params()).low.max()))
        rate.append(2.0 * (0.3 - rows.distance[0]) + rows.approach[0])  # task priority's demand
    assert low[1] >= low[0] - 1e-9 and rate[1] >= rate[0] - 1e-9


def test_what_stands_still_and_is_known_well_is_told_as_it_was(posture):
    rows = believed(posture, 0.0, 0.07, 0.0, 0.02)
    assert rows.distance[0] == pytest.approx(0.4 - UNSURE, abs=0.003) and rows.approach[0] == 0.0
    near, far = (believed(posture, s, 0.07, 0.0, 0.02).distance[0] for s in (0.002, 0.02))
    assert near > 0.4 - UNSURE - 0.006 and far == pytest.approx(0.4 - UNSURE - 0.04, abs=0.002)


def test_what_comes_is_told_where_it_is_by_now(posture):
    rows = believed(posture, 0.0, 0.1, 0.5, 0.0, ticks=1)
    assert rows.distance[0] == pytest.approx(0.4 - UNSURE - 0.05)
    assert believed(posture, 0.0, 9.0, 0.5, 0.0, ticks=1).distance[0] > 0.4 - UNSURE - 0.11
    creeps = believed(posture, 0.0, 0.2, 0.08, 0.0, ticks=1)
    assert creeps.distance[0] == pytest.approx(0.4 - UNSURE)
    faster = believed(posture, 0.0, 0.1, 0.5, 0.1, ticks=1)
    assert faster.approach[0] == pytest.approx(0.6)


def test_doubt_that_jumps_is_told_smoothly(posture):
    steady, told = Steadying(), []
    for i in range(100):
        pairs = replace(pairs_at(posture, 0.4), sigma=np.array([0.004 if i % 20 < 10 else 0.02]))
        told.append(steady.update(posture, pairs, REACH, DT).distance[0])
    assert np.abs(np.diff(told)).max() < 2.0 * 0.016 * DT / 0.15 + 1e-9
