"""The paper's trials beside a person: conditions, rows, comparisons, and a trial of a moment."""

import numpy as np
import pytest

from app.cli import main
from app.control.programs import find_program, load_program
from app.errors import ConfigError
from app.studies.hri import (
    PAPER,
    PROGRAM,
    HriSpec,
    HriStudy,
    HriTrial,
    condition_of,
    difference,
    hri,
    run_hri,
    told,
)
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
    return HriTrial(seed, mode, figures)


def test_conditions_are_controllers_and_sides_and_an_unknown_one_lists_them():
    assert condition_of("SR") == ("sm", "right") and condition_of("WBL") == ("wb", "left")
    assert condition_of("paperL") == ("paper", "left") and condition_of("QP alone") == ("qp", "")
    with pytest.raises(ConfigError, match=r"no condition 'WLB'; .*known: QP alone, QPL"):
        condition_of("WLB")


def test_every_trial_is_wanted_once_and_each_controller_alone_once():
    study = HriStudy(("SR", "WBL", "WBR"), trials=2, seed=5)
    assert study.wanted()[:2] == [(5, "S alone"), (5, "WB alone")]
    assert len(study.wanted()) == 2 + 6 == len(set(study.wanted()))
    parts = [HriStudy(("SR", "WBL", "WBR"), 2, seed=5, shard=f"{i}/3").wanted() for i in (1, 2, 3)]
    assert sorted(x for p in parts for x in p) == sorted(study.wanted())


def test_conditions_are_compared_seed_by_seed_beside_the_paper():
    means = {"SR": 0.28, "SL": 0.17, "WBR": 0.29, "WBL": 0.27}
    trials = [trial(m, s, d + 0.1 * s) for m, d in means.items() for s in range(4)]
    trials.append(trial("WB alone", 0, 0.9, waypoints_per_min=12.0))
    report = told(trials, 0)
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
    assert all(c.ok for c in report.checks)
    worse = told([t for t in trials if t.mode in ("SL", "SR")] + [
        trial(m, s, 0.16 + 0.1 * s) for m in ("WBL", "WBR") for s in range(4)
    ], 0)  # fmt: skip
    assert [c.ok for c in worse.checks] == [False, False, False] * 2 + [True]
    assert difference([trial("a", 9, 1.0), trial("a", 1, 2.0)], [trial("b", 1, 1.5)],
                      "paper_mean_m")["mean"] == pytest.approx(0.5)  # fmt: skip


def test_a_trial_that_dies_is_told_and_fails_a_check():
    dead = run_hri(HriSpec("nobody", 1, 0.1))
    assert "no condition 'nobody'" in dead.fault
    report = told([dead], 0)
    assert report.rows[0]["name"] == "fault nobody seed 1" and not report.checks[-1].ok


def test_a_moment_of_a_trial_has_every_figure_and_is_the_same_again(tmp_path):
    log = tmp_path / "hri.jsonl"
    study = HriStudy(("WBR",), trials=1, seconds=1.0, seed=3, log=log)
    report = hri(study)
    assert len(log.read_text().splitlines()) == 2  # with the controller alone
    assert repr(hri(study).rows) == repr(report.rows)  # nothing is run again
    row = next(r for r in report.rows if r["name"] == "WBR")
    assert row["true_least_m"] > 0.0 and 0.0 <= row["below_kept"] <= 1.0
    assert row["jerk_rms"] > 0.0 and np.isfinite(row["path_error_m"])
    first = TrialLog(log, {"seconds": 1.0, "rate": 125.0, "world": "honest"}, HriTrial)
    again = run_hri(HriSpec("WBR", 3, 1.0))
    assert repr(first.done[3, "WBR"]) == repr(again) and not again.fault


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


@pytest.mark.parametrize("wrong", ["--trials=0", "--jobs=0", "--seconds=0.5", "--conditions=XL"])
def test_numbers_and_names_that_make_no_study_are_refused_before_it(wrong, capsys):
    assert main(["experiment", "hri", wrong]) == 1
    err = capsys.readouterr().err
    assert "must be positive" in err or "no condition 'XL'" in err
