"""Before the paper's panels: where they stand, how controllers are compared, what is told."""

import numpy as np
import pytest

from app.judge.encounter import Notes
from app.studies.experiment import experiment_of, run_spec
from app.studies.experiments.front_panel import VARIANTS
from app.studies.panels import moved, told
from app.studies.settled import settled
from app.studies.study import Study
from app.studies.trial import TrialResult, TrialSpec
from app.world.scene import find_scene, read_scene

FIGURES = {"goal_error_m": 0.3, "true_least_m": 0.1, "jerk_rms": 9.0, "nearest_link": {"": 1.0}}


@pytest.mark.parametrize(
    ("variant", "ahead", "behind"),
    [("0.40", 0.40, 0.05), ("0.40-on", 0.40, 0.0), ("0.55", 0.55, 0.05), ("0.55-on", 0.55, 0.0)],
)
def test_the_plate_is_as_far_ahead_of_the_tool_as_the_variant_says(variant, ahead, behind):
    table = moved(read_scene(find_scene("front-panel")), 0, *VARIANTS[variant])
    plate = next(b for b in table.body if b.name == "plate")
    front = plate.position_m[0] - plate.shape.thickness_m / 2
    assert front == pytest.approx(0.464 + ahead) and plate.position_m[1] == 0.174
    assert table.goal.position_m[0] - front == pytest.approx(behind)
    assert table.goal.position_m[1:] == (0.174, 0.386)


def test_every_controller_is_tried_before_every_plate():
    conditions = [s.condition for s in Study("front-panel", trials=1).specs()]
    assert len(conditions) == 20 and "oracle@0.55-on" in conditions
    assert "SR" in [s.condition for s in Study("side-panel", trials=1).specs()]


def test_the_claim_is_checked_of_each_plate_seed_by_seed():
    trials = [
        TrialResult(seed, f"{who}@{place}", FIGURES | {"steady_m": d + 0.1 * seed})
        for who, d in (("WB", 0.30), ("S", 0.15), ("QP", 0.25)) for seed in (0, 1)
        for place in ("0.40", "0.55")
    ]  # fmt: skip
    rows, checks = told(trials)
    # the seeds differ by far more than the controllers do in each of them
    gain = next(r for r in rows if r["name"] == "WB@0.40 - S@0.40, steady_m")
    assert gain["low"] == pytest.approx(0.15) and gain["high"] == pytest.approx(0.15)
    assert [c.name for c in checks] == [f"WB@{x} - S@{x}, steady_m" for x in ("0.40", "0.55")]
    assert all(c.ok for c in checks)
    row = next(r for r in rows if r["name"] == "S@0.40")
    assert row["steady_m"] == pytest.approx(0.20)
    assert row["steady_m_low"] < 0.20 < row["steady_m_high"]


def test_an_end_is_told_from_its_last_two_seconds_and_chatter_from_all():
    n = Notes(stamp=[float(t) for t in range(6)], true=[9.0, 9.0, 9.0, 9.0, 0.2, 0.4])
    n.activation = [0.0, 1.0, 0.0, 0.0, 1.0, 1.0]
    n.tool, n.goal = [np.zeros(3)] * 6, [np.array([d, 0.0, 0.0]) for d in (5, 5, 5, 5, 1, 3)]
    end = settled(n)
    assert end["steady_m"] == pytest.approx(0.3) and end["steady_std_m"] == pytest.approx(0.1)
    assert end["goal_error_m"] == 2.0 and end["goal_std_m"] == 1.0
    assert end["chatter_per_s"] == pytest.approx(3.0 / 5.0)


@pytest.mark.parametrize(
    ("name", "condition"), [("front-panel", "QP@0.40-on"), ("side-panel", "WBR")]
)
def test_a_moment_before_a_plate_has_its_figures(name, condition):
    result = run_spec(TrialSpec(name, condition, 1, 0.6))
    assert not result.fault and 0.3 < result.figures["steady_m"] < 0.6
    told_of = experiment_of(name).tell([result])
    assert told_of.rows[0]["name"] == condition and told_of.checks == []
    assert told_of.rows[0]["own_contacts"] == 0 and told_of.rows[0]["goal_error_m"] > 0.1
