"""The elementary situations: where the ball is, where the goal goes, what is told of them."""

import numpy as np
import pytest

from app.studies.experiment import experiment_of, run_spec
from app.studies.experiments.elementary import PACE, SIDE, along, case
from app.studies.trial import TrialResult, TrialSpec

ELEMENTARY = experiment_of("elementary")


def ball_at(variant, times):
    condition = f"QP@{variant}"
    scene = case(TrialSpec("elementary", condition, 0, 1.0), ELEMENTARY.read(condition)).scene
    body = next(b for b in scene.bodies if b.name == "ball")
    return np.array([body.motion.pose(t)[:3, 3] for t in times])


def test_there_are_three_arms_times_three_still_and_six_moving_balls():
    assert len(ELEMENTARY.variants) == 27 == len(set(ELEMENTARY.variants))
    assert {"static-on", "line-near", "circle-head-on-1.0"} <= set(ELEMENTARY.variants)


@pytest.mark.parametrize("speed", ["0.2", "1.0"])
def test_a_ball_crosses_or_comes_head_on_at_the_speed_of_its_name(speed):
    times = np.arange(0.0, 8.0, 0.01)
    for way, axis, gap in (("crossing", 0, 0.15), ("head-on", 1, 0.10)):
        at = ball_at(f"line-{way}-{speed}", times)
        pace = np.linalg.norm(np.diff(at, axis=0), axis=1) / 0.01
        assert pace.max() == pytest.approx(float(speed), rel=0.01)
        assert np.ptp(at[:, axis]) > 0.7 and np.ptp(at[:, 1 - axis]) == 0.0
        nearest = (at[:, 1] - SIDE[1] - 0.10).min()
        assert nearest >= gap - 1e-9 and (nearest < gap + 1e-9 or speed == "0.2")


def test_the_goal_goes_to_and_fro_on_a_line_and_round_a_circle_and_begins_where_the_tool_is():
    times = np.arange(0.0, 8.0, 0.01)
    line, circle = (np.array([along(arm, t) for t in times]) for arm in ("line", "circle"))
    for way in (line, circle):
        assert not way[0].any()
        pace = np.linalg.norm(np.diff(way, axis=0), axis=1) / 0.01
        assert pace.max() == pytest.approx(PACE, rel=0.01)
    assert np.abs(line).max(axis=0) == pytest.approx([0.0, 0.25, 0.0], abs=1e-3)
    assert np.linalg.norm(circle - [-0.15, 0.0, 0.0], axis=1) == pytest.approx(0.15)
    assert not along("static", 3.0).any()


def test_a_controller_has_one_row_and_is_compared_in_the_same_situations():
    def trial(name, seed, least, contacts=0):
        figures = {
            "distal_least_m": least, "path_error_m": 0.1, "jerk_rms": 1.0, "contacts": contacts,
            "own_contacts": contacts, "nearest_link": {"": 1.0},
        }  # fmt: skip
        return TrialResult(seed, name, figures)

    trials = [
        trial(f"{who}@{where}", 0, base + gain, contacts)
        for who, gain, contacts in (("WB", 0.0, 0), ("QP", 0.05, 1))
        for where, base in (("static-on", 0.1), ("line-off", 0.5))
    ]  # fmt: skip
    rows, checks = ELEMENTARY.tell(trials)
    by = {r["name"]: r for r in rows}
    assert by["WB"]["situations"] == 2 and by["WB"]["touched"] == ""
    assert by["QP"]["touched"] == "line-off static-on" and not checks[0].ok
    assert by["QP - WB, distal_least_m"]["mean"] == pytest.approx(0.05)
    assert by["QP - WB, distal_least_m"]["n"] == 2


def test_a_moment_on_the_circle_moves_the_goal_and_has_its_figures():
    result = run_spec(TrialSpec("elementary", "WB@circle-crossing-1.0", 0, 0.5))
    assert not result.fault and 0.2 < result.figures["distal_least_m"] < 2.0
    assert result.figures["path_error_m"] > 0.005
