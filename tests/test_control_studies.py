"""The studies of the control room, small: their rows, their causes and their checks."""

import json

import numpy as np
import pytest

from app.bench.control_cases import make_cases
from app.cli import main
from app.errors import ConfigError
from app.judge.metrics import jerk_rms
from app.judge.truth import TrueDistance
from app.plot import check_plot, plot_tradeoff
from app.studies.random_scene import CLEAR, random_goal, random_world
from app.studies.tradeoff import Point, checks, mean, run_point, switches
from app.studies.trial import TrialResult, TrialSpec
from app.studies.trial_log import TrialLog
from app.studies.world_trial import Stage, condition, run_trial


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


@pytest.mark.parametrize("name", ["S", "WB", "QP", "oracle"])
def test_a_trial_exceeds_no_limit_and_raises_nothing(robot, skin, truth, name):
    spec = TrialSpec("worlds", name, 3, 1.0, 100.0)
    t = run_trial(Stage(robot, skin, truth), spec, condition(name))
    assert t.finite and not t.stop and np.isfinite(t.least)
    assert max(t.speed, t.reach) <= 1e-9 and t.change <= 1e-6


def test_smoothness_and_chatter_are_measured_as_defined():
    t = np.arange(0.0, 1.0, 0.01)
    assert jerk_rms(np.stack((t**2, 0 * t), axis=1), 100.0) == pytest.approx(np.sqrt(2.0))
    assert switches([False, True, True, False]) == 2


def test_a_point_of_the_trade_off_has_the_figures(robot):
    row = run_point(Point("front-panel", "qp", True, 0.2), 0.5, 0, 100.0)
    assert row["least_m"] > 0.2 and row["stops"] == 0 and row["jerk_rms"] > 0.0
    assert row["distal_least_m"] >= row["least_m"] and row["mode"] == "qp"
    paper = Point("cell", "wb", False, 0.2)
    assert paper.params().distance_kept == 0.2 and not paper.params().memory
    assert Point("cell", "wb", True, 0.2).name == "wb with memory"


def test_points_of_several_seeds_are_averaged_and_compared_where_as_much_work_is_done():
    def row(mode, kept, least, waypoints, scene="cell"):
        return {
            "name": f"{mode} {kept}", "scene": scene, "mode": mode, "kept_m": kept,
            "least_m": 0.09, "distal_least_m": least, "above_d_min": 0.9,
            "distal_above_d_min": 0.9, "waypoints_per_min": waypoints, "jerk_rms": 1.0, "stops": 1,
        }  # fmt: skip

    both = mean([row("qp", 0.2, 0.1, 6.0), row("qp", 0.2, 0.3, 9.0)])
    assert both["distal_least_m"] == pytest.approx(0.2) and both["waypoints_per_min"] == 7.5
    assert both["stops"] == 2 and both["seeds"] == 2 and both["mode"] == "qp"
    wb = row("wb", 0.25, 0.15, 8.0)
    idle, busy = row("qp", 0.30, 0.40, 7.0), row("qp", 0.10, 0.16, 8.0)
    first = checks([wb, idle, busy])[0]
    assert first.value == pytest.approx(0.01) and first.ok  # not the one that does less
    assert not checks([wb, idle])[0].ok


def test_the_trade_off_is_drawn_and_what_cannot_be_drawn_is_refused_before_the_runs(tmp_path):
    pytest.importorskip("matplotlib")
    rows = [
        {"scene": scene, "mode": mode, "kept_m": kept, "least_m": kept, "goal_error_m": 0.3 - kept,
         "distal_p5_m": kept, "waypoints_per_min": 9.0 if scene == "cell" else 0.0}
        for scene in ("front-panel", "cell") for mode in ("wb", "qp") for kept in (0.15, 0.25)
    ]  # fmt: skip
    for kind in ("png", "svg"):
        path = tmp_path / f"points.{kind}"
        check_plot(path)
        plot_tradeoff(rows, path)
        assert path.stat().st_size > 5_000
    for wrong, word in (
        (tmp_path / "points.pdf", "ends in"),
        (tmp_path / "no" / "p.png", "folder"),
    ):
        with pytest.raises(ConfigError, match=word):
            check_plot(wrong)


def test_trials_are_kept_on_disk_and_are_not_run_again(tmp_path):
    path, settings = tmp_path / "trials.jsonl", {"seconds": 1.0, "rate": 100.0}
    log = TrialLog(path, settings, TrialResult)
    log.add(TrialResult(3, "qp", {"least": 0.2, "touch": {"cause": "no free direction"}}))
    again = TrialLog(path, settings, TrialResult)
    assert again.done[3, "qp"].figures["touch"] == {"cause": "no free direction"}
    assert again.missing([(3, "qp"), (3, "wb")]) == [(3, "wb")]
    with pytest.raises(ConfigError, match="made with"):
        TrialLog(path, {"seconds": 2.0, "rate": 100.0}, TrialResult)
    path.write_text("{}\n")
    with pytest.raises(ConfigError, match="line 1: not a trial"):
        TrialLog(path, settings, TrialResult)


def test_a_line_that_was_torn_by_a_kill_is_run_again_and_the_log_is_whole_after_it(tmp_path):
    path, settings = tmp_path / "trials.jsonl", {"seconds": 1.0}
    log = TrialLog(path, settings, TrialResult)
    for seed in (1, 2):
        log.add(TrialResult(seed, "qp", {"least": 0.2}))
    whole = path.read_text()
    path.write_text(whole[:-30])
    torn = TrialLog(path, settings, TrialResult)
    assert torn.missing([(1, "qp"), (2, "qp")]) == [(2, "qp")]
    assert path.read_text() == whole[:-30]  # only looked at so far
    torn.add(TrialResult(2, "qp", {"least": 0.2}))
    assert path.read_text() == whole


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
