"""The judges of the perception benchmark: slow answers that agree with known shapes."""

import numpy as np
import pytest
import trimesh

from app.bench.exactness import filter_disagreements, worst_distance
from app.bench.perception import make_scene
from app.judge.reference import first_hit, nearest_of, signed_distance
from app.perception.calibration import LEAST, suggest
from app.perception.rules import Rules


@pytest.fixture
def ball():
    return np.array(trimesh.creation.icosphere(subdivisions=4, radius=0.5).triangles)


def test_the_reference_distance_is_signed_and_right_for_a_ball(ball):
    for r in (0.0, 0.2, 0.4, 0.6, 2.0):
        assert signed_distance(np.array([r, 0.0, 0.0]), ball) == pytest.approx(r - 0.5, abs=2e-3)
    beside = np.array([[np.nan] * 3, [0.0, 2.0, 0.0]])
    assert nearest_of(beside, ball) == pytest.approx(1.5, abs=2e-3)
    assert nearest_of(np.empty((0, 3)), ball) == np.inf


def test_the_reference_ray_hits_a_ball_and_misses_beside_it(ball):
    z = np.array([0.0, 0.0, 1.0])
    assert first_hit(np.array([0.0, 0.0, -2.0]), z, ball, 0.0) == pytest.approx(1.5, abs=2e-3)
    assert first_hit(np.array([0.6, 0.0, -2.0]), z, ball, 0.0) == np.inf
    assert first_hit(np.zeros(3), z, ball, 0.6) == np.inf


@pytest.mark.slow
def test_no_verdict_differs_from_float64(robot, skin):
    scene = make_scene(robot, skin, 0, 2)
    for nine, postures in ((False, scene), (True, scene[:1])):
        wrong, compared = filter_disagreements(robot, skin, postures, Rules(footprint=nine))
        assert wrong == 0 and compared > 250


def test_distances_are_exact_on_touching_inside_empty_and_nan_clouds(robot):
    worst, cases = worst_distance(robot, 300, 1)
    assert worst < 1e-5 and cases == 300


def test_a_suggested_threshold_covers_nearly_all_self_returns():
    rng = np.random.default_rng(0)
    gap = rng.normal(0.0, 0.004, 5000)
    link = np.zeros(5000, dtype=np.int16)
    edge = np.arange(5000) < 2500
    gap[edge] *= 2.0
    first, second = suggest(("a", "b"), link, gap, np.zeros(5000), edge)
    assert 0.010 < first.eps < 0.016 and np.mean(gap[~edge] > first.eps) <= 0.001
    assert 0.020 < first.edge < 0.032 and np.mean(gap[edge] > first.edge) <= 0.001
    assert first.histogram.sum() > 4990
    assert np.isnan(second.eps) and second.returns == 0 and LEAST > 0
