"""The study of sensors' faults: what it spoils, whom it blames, what it checks."""

import numpy as np
import pytest

from app.sensing.source import Unfailing
from app.studies.experiment import run_spec
from app.studies.experiments.faults import checks, told
from app.studies.faulty_skin import KINDS, SUN, FaultySkin
from app.studies.study import Study
from app.studies.trial import TrialResult, TrialSpec
from tests.fakes import frame


class Eye(Unfailing):
    """Two sensors; what they see comes nearer by a millimetre a frame."""

    name, connected = "two", np.ones(30, dtype=bool)

    def __init__(self):
        self.i = 0

    def poll(self, now, posture):
        self.i += 1
        return [frame(k, now, 1.0 - 0.001 * self.i, sequence=self.i) for k in (3, 4)]

    def ended(self):
        return ""


@pytest.mark.parametrize("kind", KINDS)
def test_the_sensors_that_fail_do_so_in_their_way_and_the_others_do_not(robot, skin, kind):
    eye, posture = FaultySkin(Eye(), skin, kind, seed=1), robot.posture(robot.home)
    sound = eye.poll(0.0, posture)
    assert [f.sensor for f in sound] == [3, 4] and sound[0].distance.max() == 0.999
    eye.fail([3])
    for i in (1, 2):
        frames = {f.sensor: f for f in eye.poll(i / 15, posture)}
        assert frames[4].distance.max() == pytest.approx(0.999 - 0.001 * i)
        assert (frames[4].status == 5).all()
        if kind == "dead":
            assert set(frames) == {4}
            continue
        bad = frames[3]
        assert bad.stamp == i / 15 and bad.sequence == i + 1  # it goes on speaking
        assert (bad.distance == sound[0].distance).all() == (kind == "frozen")
        assert (bad.status == SUN).all() == (kind == "sun")
        assert ((bad.status == 4).sum() == 32) == (kind == "half")
        assert (bad.targets == 0).all() == (kind == "black")
        assert (bad.distance < 0.015).all() == (kind == "covered")


def test_a_run_says_what_the_fault_cost_and_that_nothing_was_run_into():
    result = run_spec(TrialSpec("faults", "QP+dead:14@front-panel", 0, 1.6, world="ideal"))
    (row,), _ = told([result])
    assert row["own_contacts"] == row["contacts"] == 0 and row["least_m"] > 0.2
    assert row["blind"] == pytest.approx(14 / 30) and "and 11 more" in row["advice"]
    assert row["status"].startswith("running") and row["sensors"] == 14


def test_a_hand_lies_on_the_window_that_looks_most_towards_the_goal():
    result = run_spec(TrialSpec("faults", "QP+hand:1@front-panel", 0, 0.3, world="ideal"))
    assert 0.0 <= result.figures["true_least_m"] < 0.02


def test_each_controllers_work_is_compared_with_its_own_without_the_fault():
    study = Study("faults", ("QP-memory+dead:3@cell", "QP+black:1"), seed=2)
    wanted = [s.condition for s in study.specs()]
    assert wanted[:3] == ["QP-memory@cell", "QP@front-panel", "QP@cell"] and len(wanted) == 6
    figures = {
        "own_contacts": 0, "contacts": 0, "own_mps": 0.0, "true_least_m": 0.1, "blind": 0.1,
        "speed_rad_s": 0.1, "status": "running", "advice": "",
    }  # fmt: skip
    trials = [
        TrialResult(2, name, figures | {"way_m": way})
        for name, way in (("QP@cell", 2.0), ("QP+black:1@cell", 1.0))
    ]
    rows, found = told(trials)
    assert [r["work"] for r in rows] == [1.0, 0.5] and [c.ok for c in found] == [True, False]
    assert len(Study("faults").specs()) == 64


def test_a_contact_of_the_arms_own_and_a_day_lost_to_one_sensor_are_missed_checks():
    row = {"name": "cell dead 1", "kind": "dead", "sensors": 1, "own_contacts": 0, "work": 0.9}
    assert all(c.ok for c in checks([row, row | {"sensors": 9, "work": 0.1}]))
    assert [c.ok for c in checks([row | {"own_contacts": 1, "work": 0.5}])] == [False, False]
