"""The studies of the control room, small: their rows, their causes and their checks."""

import json

import numpy as np
import pytest

from app.cli import main
from app.studies.bench_control import make_cases
from app.studies.random_worlds import CLEAR, random_goal, random_world, run_trial
from app.studies.tradeoff import Point, jerk_rms, run_point, switches
from app.studies.truth import TrueDistance


@pytest.fixture(scope="module")
def truth(robot):
    return TrueDistance([(b.vertices, b.faces) for b in robot.bodies])


def test_a_random_world_is_the_same_for_the_same_seed_and_leaves_room_at_the_start(robot, truth):
    for seed in range(5):
        one = random_world(robot, truth, np.random.default_rng(seed))
        two = random_world(robot, truth, np.random.default_rng(seed))
        assert [p.view.name for p in one.poses()] == [p.view.name for p in two.poses()]
        assert all(
            np.array_equal(a.T_base_body, b.T_base_body)
            for a, b in zip(one.poses(), two.poses(), strict=True)
        )
        home = robot.posture(robot.home).T_base_link
        moving = robot.supports.any(axis=1)
        assert truth.measure(home, one)[moving].min() > CLEAR
    assert random_goal(robot, np.random.default_rng(0)).T_base_tool[2, 3] > 0.2


@pytest.mark.parametrize("mode", ["sm", "wb", "qp"])
def test_a_trial_exceeds_no_limit_and_raises_nothing(robot, skin, truth, mode):
    t = run_trial(robot, skin, truth, 3, mode, 1.0, 100.0)
    assert t.finite and not t.fault and np.isfinite(t.least)
    assert max(t.speed, t.reach) <= 1e-9 and t.change <= 1e-6


def test_smoothness_and_chatter_are_measured_as_defined():
    t = np.arange(0.0, 1.0, 0.01)
    assert jerk_rms(np.stack((t**2, 0 * t), axis=1), 100.0) == pytest.approx(np.sqrt(2.0))
    assert switches([False, True, True, False]) == 2


def test_a_point_of_the_trade_off_has_the_figures(robot):
    row = run_point(Point("front-panel", "qp", 0.2), 0.5, 0, 100.0)
    assert row["least_m"] > 0.2 and row["stops"] == 0 and row["jerk_rms"] > 0.0
    assert Point("cell", "wb", 0.2).params().d_min == pytest.approx(0.15)


def test_the_benchs_pairs_are_new_in_every_case_and_on_links_that_move(robot):
    a, b = make_cases(robot, 12, 2, 0)
    assert len(a.pairs.distance) == 12 and robot.supports.any(axis=1)[a.pairs.link].all()
    assert not np.array_equal(a.pairs.distance, b.pairs.distance)


@pytest.mark.slow
def test_the_bench_prints_one_object(capsys):
    assert main(["bench", "control", "--seconds", "0.5", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    names = [c["name"] for c in report["checks"]]
    assert "qp with 12 pairs, median" in names and "qp, unsolved of 10000" in names
