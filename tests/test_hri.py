"""The paper's trials beside a person: rows, comparisons, and a trial of a moment."""

import numpy as np
import pytest

from app.cli import main
from app.control.programs import find_program, load_program
from app.studies.experiment import run_spec
from app.studies.experiments.hri import PAPER, PROGRAM, told
from app.studies.study import Study, locally, run_study, tell
from app.studies.trial import TrialResult, TrialSpec
from app.studies.trial_log import TrialLog
from app.world.scene import find_scene, load_scene

FIGURES = {
    "paper_mean_m": 0.2, "paper_std_m": 0.1, "true_mean_m": 0.2, "true_std_m": 0.1,
    "true_least_m": 0.05, "cell_least_m": 0.08, "contacts": 1, "stops": 0,
    "waypoints_per_min": 6.0, "reaction_s": float("nan"),
    "nearest_link": {"forearm": 0.95, "": 0.05},
}  # fmt: skip


def trial(mode, seed, mean, **more):
    figures = FIGURES | {"paper_mean_m": mean, "true_mean_m": mean + 0.01} | more
    return TrialResult(seed, mode, figures)


def test_every_trial_is_wanted_once_and_each_controller_alone_once():
    study = Study("hri", ("SR", "WBL", "WBR-memory"), trials=2, seed=5)
    specs = study.specs()
    assert [s.condition for s in specs[:2]] == ["S alone", "WB alone"]
    assert len(specs) == 2 + 6 == len(set(specs)) and {s.seed for s in specs} == {5, 6}
    assert all(s.seconds == 60.0 for s in specs)


def test_conditions_are_compared_seed_by_seed_beside_the_paper():
    means = {"SR": 0.28, "SL": 0.17, "WBR": 0.29, "WBL": 0.27}
    trials = [trial(m, s, d + 0.1 * s) for m, d in means.items() for s in range(4)]
    trials.append(trial("WB alone", 0, 0.9, waypoints_per_min=12.0))
    report = told(trials)
    rows = {r["name"]: r for r in report.rows}
    assert rows["SR"]["paper_dbar_m"] == PAPER["SR"][0] and rows["SR"]["trials"] == 4
    assert rows["SR"]["dbar_m"] == pytest.approx(0.43)
    assert rows["SR"]["low_m"] < 0.43 < rows["SR"]["high_m"]
    assert rows["SR"]["contacts"] == 4 and "reaction_s" not in rows["SR"]
    assert rows["WBL"]["work"] == pytest.approx(0.5) and "work" not in rows["SL"]
    assert rows["WBL"]["nearest"] == {"forearm": 0.95}
    # the seeds differ by far more than the controllers do in each of them
    gain = rows["WBL - SL, paper_mean_m"]
    assert gain["low"] == pytest.approx(0.1) and gain["high"] == pytest.approx(0.1)
    assert gain["n"] == 4 and gain["p"] == pytest.approx(2.0**-3)
    assert all(c.ok for c in report.checks)
    worse = told([t for t in trials if t.mode in ("SL", "SR")] + [
        trial(m, s, 0.16 + 0.1 * s) for m in ("WBL", "WBR") for s in range(4)
    ])  # fmt: skip
    assert [c.ok for c in worse.checks] == [False, False, False] * 2


def test_a_trial_that_dies_is_told_and_fails_a_check():
    dead = run_spec(TrialSpec("hri", "nobody", 1, 0.1))
    assert "no condition 'nobody'" in dead.fault
    report = tell(Study("hri"), [dead])
    assert report.rows[0]["name"] == "fault nobody seed 1" and not report.checks[-1].ok


def test_a_moment_of_a_trial_has_every_figure_and_is_the_same_again(tmp_path):
    log = tmp_path / "trials.jsonl"
    study = Study("hri", ("WBR",), trials=1, seconds=1.0, seed=3)
    results = run_study(study, locally(), log)
    assert len(log.read_text().splitlines()) == 2  # with the controller alone
    again = run_study(study, None, log)  # nothing is run again, nobody could
    assert repr(again) == repr(results)
    row = next(r for r in tell(study, results).rows if r["name"] == "WBR")
    assert row["true_least_m"] > 0.0 and 0.0 <= row["below_kept"] <= 1.0
    assert row["jerk_rms"] > 0.0 and np.isfinite(row["path_error_m"])
    first = TrialLog(log, study.settings, TrialResult)
    assert repr(first.done[3, "WBR"]) == repr(run_spec(study.specs()[1]))
    course = results[1].course
    assert len({len(values) for values in course.values()}) == 1 and len(course["true_m"]) == 14


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_two_cells_are_mirrors_but_for_the_arm(side):
    scene = load_scene(find_scene(f"cell-{side}"))
    sign, middle = (1.0 if side == "left" else -1.0), 0.10
    at = {b.name: b.motion.pose(0.0)[:3, 3] for b in scene.bodies if "/" not in b.name}
    assert sign * (at["toolbox"][1] - middle) == pytest.approx(0.12)
    assert at["door panel"][1] == at["table"][1] == pytest.approx(middle)
    y = [
        sign * (b.motion.pose(t)[1, 3] - middle)
        for b in scene.bodies if b.name == "operator/pelvis" for t in np.arange(0.0, 60.0, 1.0)
    ]  # fmt: skip
    assert min(y) > 0.45  # keeps to its side, beside the table
    screws = np.array([w.T_base_tool[1, 3] for w in load_program(find_program(PROGRAM)).waypoints])
    assert screws.mean() == pytest.approx(middle)


@pytest.mark.parametrize("wrong", ["--trials=0", "--jobs=0", "--seconds=0", "--conditions=XL"])
def test_numbers_and_names_that_make_no_study_are_refused_before_it(wrong, capsys):
    assert main(["experiment", "hri", wrong]) == 1
    err = capsys.readouterr().err
    assert "must be positive" in err or "no condition 'XL'" in err
