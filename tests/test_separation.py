"""Speed and separation: the model's own check values, and what it does as a bound."""

from dataclasses import replace

import numpy as np
import pytest

from app.config import Params
from app.control.bounds.pairs import PairBounds
from app.control.bounds.separation import SeparationBounds
from app.control.registry import kind_of
from app.control.separation import allowed_speed, needed, person_speed, protective_distance
from app.messages import Goal, JointState, Pairs
from tests.alone import alone, bound_by

DISTANCES = np.array([0.3, 0.5, 0.8, 1.2])


@pytest.mark.parametrize(
    ("person", "speeds"),
    [(1.0, [0.06, 0.40, 0.83, 1.29]), (1.6, [0.0, 0.175, 0.54, 0.96])],
)
def test_the_allowed_speed_has_its_known_values(person, speeds):
    allowed = allowed_speed(DISTANCES, Params(person_speed=person))
    assert allowed == pytest.approx(speeds, abs=0.005)


def test_the_allowed_speed_is_the_one_whose_protective_distance_is_there():
    params = Params(person_speed=1.0)
    v = allowed_speed(DISTANCES, params)
    assert protective_distance(v, params) == pytest.approx(DISTANCES)
    assert allowed_speed(np.array([0.0, -1.0]), params) == pytest.approx([0.0, 0.0])


def test_as_a_bound_it_limits_the_approach_and_never_demands_a_retreat(robot):
    posture = robot.posture(robot.home)
    tool = posture.T_base_tool[:3, 3].copy()
    n = np.array([[-1.0, 0.0, 0.0]])

    def low(distance, **settings):
        d = np.array([distance])
        on = tool[None]
        pairs = Pairs(np.array([6]), d, on, on - d * n, n, np.zeros(1, dtype=int), 0)
        params = Params(mode="qp", **settings)
        kinds = (PairBounds(), *((SeparationBounds(),) if params.separation else ()))
        return float(bound_by(robot, kinds, posture, pairs, params).low.max())

    assert low(0.55) < low(0.55, separation=True) < 0.0
    assert low(0.3, separation=True) == pytest.approx(0.0)  # a person could be there in time
    assert low(0.15, separation=True) == low(0.15) > 0.0  # the distance kept wins inside it
    assert low(0.55, separation=True, person_speed=0.0, reaction_time=0.02) == low(0.55)


def test_an_older_measurement_and_a_faster_person_ask_for_more_room():
    params = Params()
    d, v = np.array([0.8]), np.array([0.3])
    assert protective_distance(v, params, age=0.10) == protective_distance(v, params)
    later = protective_distance(v, params, age=0.20) - protective_distance(v, params)
    assert later == pytest.approx(0.1 * (params.person_speed + 0.3))  # both go on for so long
    assert allowed_speed(d, params, age=0.3) < allowed_speed(d, params)
    assert allowed_speed(d, params, v_h=0.5, age=0.0) > allowed_speed(d, params)
    assert allowed_speed(d, params, age=np.inf) == 0.0


def test_a_measured_person_is_believed_with_a_margin_and_never_taken_for_faster_than_assumed():
    on, n = np.zeros((3, 3)), np.tile([-1.0, 0.0, 0.0], (3, 1))
    approach = np.array([0.0, 0.4, 3.0])
    pairs = Pairs(np.full(3, 6), np.ones(3), on, on + n, n, np.arange(3), 0, approach)
    assert person_speed(pairs, Params()) == pytest.approx([1.6, 1.6, 1.6])
    measured = Params(person_speed_measured=True)
    assert person_speed(pairs, measured) == pytest.approx([0.25, 0.65, 1.6])
    closing = np.array([0.2, 0.0, 0.0])
    assert needed(pairs, closing, measured) < needed(pairs, closing, Params())
    assert needed(pairs, closing, Params()) == protective_distance(closing[0], Params())
    assert needed(pairs, -closing, Params()) == protective_distance(np.array(0.0), Params())


def test_the_ring_is_of_the_nearest_pair_at_the_speed_that_is_measured(robot):
    control, params = alone(robot, "ssm"), Params(mode="ssm")
    posture = robot.posture(robot.home)
    on = posture.T_base_tool[None, :3, 3].copy()
    d, n = np.array([0.8]), np.array([[-1.0, 0.0, 0.0]])
    pairs = Pairs(np.array([6]), d, on, on - d * n, n, np.zeros(1, dtype=int), 0)
    goal = Goal(posture.T_base_tool)

    def ring(qd, params=params, age=None):
        control.reset(qd)
        now = JointState(0.0, robot.home, qd)
        given = replace(pairs, age=None if age is None else np.array([age]))
        return control.update(posture, now, given, goal, params, 0.004).protective

    still = np.zeros(6)
    J = posture.distance_rows(pairs.link, on, n)[0]
    assert ring(still) == pytest.approx(float(protective_distance(np.array(0.0), params)))
    v = 0.2 * float(J @ J)
    assert ring(-0.2 * J) == pytest.approx(float(protective_distance(np.array(v), params)))
    assert ring(0.2 * J) == pytest.approx(ring(still))  # it goes away
    assert ring(still, age=0.3) > ring(still) + 0.3
    control = alone(robot)
    assert ring(still, Params()) == 0.0 < ring(still, Params(separation=True))


@pytest.mark.parametrize("mode", ["qp", "ssm"])
@pytest.mark.parametrize(
    ("distance", "slow"), [(0.45, {}), (0.65, {}), (1.1, {}), (1.7, {"separation_margin": 1.0}),
                           (3.0, {"separation_margin": 1.0, "reaction_time": 1.0})],
)  # fmt: skip
def test_it_bounds_the_approach_at_every_distance(robot, mode, distance, slow):
    """Also beyond d_inf, where the QP itself bounds nothing, and beyond where memory looks."""
    posture = robot.posture(robot.home)
    on, n = posture.T_base_tool[None, :3, 3].copy(), np.array([[-1.0, 0.0, 0.0]])
    pairs = Pairs(
        np.array([len(robot.links) - 1]), np.array([distance]), on, on - distance * n, n,
        np.zeros(1, dtype=int), 0,
    )  # fmt: skip
    far = posture.T_base_tool.copy()
    far[0, 3] += 1.5
    J = posture.distance_rows(pairs.link, on, n)[0]

    def closing(**settings):
        params = Params(mode=mode, goal_speed=1.0, joint_speed=1.0, **slow, **settings)
        control, qd = alone(robot, mode), np.zeros(robot.n)
        for _ in range(300):
            joints = JointState(0.0, robot.home, qd)
            qd = control.update(posture, joints, pairs, Goal(far), params, 0.004).qd
        return float(-J @ qd), float(allowed_speed(np.array(distance), params))

    fast, allowed = closing(separation=True)
    assert fast <= allowed + 1e-6
    assert kind_of(mode).needs(Params(mode=mode, separation=True)).reach == np.inf
    if mode == "qp" and distance > 0.6:
        assert closing(separation=False)[0] > allowed + 0.05
