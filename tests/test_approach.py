"""A person who walks at the arm: how fast, where, and what is told of it."""

import numpy as np
import pytest

from app.judge.encounter import Notes
from app.studies.experiment import experiment_of, run_spec
from app.studies.trial import TrialResult, TrialSpec

APPROACH = experiment_of("approach")


def case(condition):
    spec = TrialSpec("approach", condition, 0, 1.0)
    return APPROACH.case(spec, APPROACH.read(condition))


@pytest.mark.parametrize("variant", ["0.3", "1.6", "0.6-by"])
def test_the_person_walks_at_the_variants_speed_at_the_arm_or_past_it(variant):
    scene = case(f"QP@{variant}").scene
    pelvis = next(b for b in scene.bodies if b.name == "person/pelvis")
    at = np.array([pelvis.motion.pose(t)[:3, 3] for t in np.arange(0.0, 5.0, 0.01)])
    speed = np.linalg.norm(np.diff(at[:, :2], axis=0), axis=1) / 0.01
    assert np.median(speed[speed > 0.05]) == pytest.approx(
        float(variant.removesuffix("-by")), rel=0.05
    )
    assert (np.ptp(at[:, 0]) > np.ptp(at[:, 1])) == variant.endswith("-by")


def test_a_reaction_is_counted_from_where_the_controllers_avoidance_begins():
    n = Notes(stamp=[0.1 * i for i in range(20)], true=[1.95 - 0.1 * i for i in range(20)])
    n.activation = [0.0] * 17 + [1.0] * 3
    qp = case("QP@1.0").more(n)
    assert qp["begins_m"] == 0.60 and qp["entered_s"] == pytest.approx(0.3)
    assert qp["least_m"] == pytest.approx(0.05)
    n.activation = [1.0] * 20
    assert np.isnan(case("QP@1.0").more(n)["entered_s"])


def test_whatever_our_controller_runs_into_fails_its_check():
    figures = {
        "least_m": 0.1,
        "distal_least_m": 0.2,
        "entered_s": np.nan,
        "true_least_m": 0.1,
        "nearest_link": {"": 1.0},
    }
    trials = [
        TrialResult(seed, name, figures | {"own_contacts": seed})
        for name in ("QP@1.0", "S@1.0") for seed in (0, 1)
    ]  # fmt: skip
    rows, checks = APPROACH.tell(trials)
    assert [r["own_contacts"] for r in rows[:2]] == [1, 1] and "entered_s" not in rows[0]
    assert [(c.name, c.ok) for c in checks] == [("QP@1.0: moved into", False)]


def test_a_moment_of_an_approach_has_its_figures():
    result = run_spec(TrialSpec("approach", "WB@1.6-by", 0, 0.4))
    assert not result.fault and result.figures["least_m"] > 0.5
    assert result.figures["distal_least_m"] >= result.figures["least_m"]
    assert APPROACH.tell([result]).rows[0]["least_m"] == result.figures["least_m"]
