"""Speed and separation: the model's own check values, and what it does as a bound."""

import numpy as np
import pytest

from app.config import Params
from app.control.rows import Bounds
from app.control.separation import allowed_speed, protective_distance
from app.messages import Pairs

DISTANCES = np.array([0.3, 0.5, 0.8, 1.2])


@pytest.mark.parametrize(
    ("person", "speeds"),
    [(1.0, [0.06, 0.40, 0.83, 1.29]), (1.6, [0.0, 0.175, 0.54, 0.96])],
)
def test_the_allowed_speed_has_its_known_values(person, speeds):
    allowed = allowed_speed(DISTANCES, Params(ssm_person=person))
    assert allowed == pytest.approx(speeds, abs=0.005)


def test_the_allowed_speed_is_the_one_whose_protective_distance_is_there():
    params = Params(ssm_person=1.0)
    v = allowed_speed(DISTANCES, params)
    assert protective_distance(v, params) == pytest.approx(DISTANCES)
    assert allowed_speed(np.array([0.0, -1.0]), params) == pytest.approx([0.0, 0.0])


def test_as_a_bound_it_limits_the_approach_and_never_demands_a_retreat(robot):
    posture = robot.posture(robot.home)
    tool = posture.T_base_tool[:3, 3]
    n, bounds = np.array([[-1.0, 0.0, 0.0]]), Bounds(robot)

    def low(distance, **settings):
        d = np.array([distance])
        on = tool[None]
        pairs = Pairs(np.array([6]), d, on, on - d * n, n, np.zeros(1, dtype=int), 0)
        params = Params(mode="qp", xi=3.0, **settings)
        wide = np.full(6, np.inf)
        rows = bounds.rows(posture, pairs, params, -wide, wide, np.zeros(6), 1e6)
        return float(rows.low[rows.source == 0][0])

    assert low(0.55) < low(0.55, separation=True) < 0.0
    assert low(0.3, separation=True) == pytest.approx(0.0)  # a person could be there in time
    assert low(0.15, separation=True) == low(0.15) > 0.0  # the distance kept wins inside it
    assert low(0.55, separation=True, ssm_person=0.0, ssm_reaction=0.02) == low(0.55)
