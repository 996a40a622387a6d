"""The study of sensors' faults: what it spoils, whom it blames, what it checks."""

import numpy as np
import pytest

from app.cli import main
from app.sensing.source import Unfailing
from app.studies.faults import FaultSpec, checks, run_fault
from app.studies.faulty_skin import KINDS, SUN, FaultySkin
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
    row = run_fault(FaultSpec("front-panel", "dead", 14, 0), 1.6, "ideal")
    assert row["own_contacts"] == row["contacts"] == 0 and row["least_m"] > 0.2
    assert row["blind"] == pytest.approx(14 / 30) and "and 11 more" in row["advice"]
    assert row["status"].startswith("running")


def test_a_contact_of_the_arms_own_and_a_day_lost_to_one_sensor_are_missed_checks():
    row = {"name": "cell dead 1", "kind": "dead", "sensors": 1, "own_contacts": 0, "work": 0.9}
    assert all(c.ok for c in checks([row, row | {"sensors": 9, "work": 0.1}]))
    assert [c.ok for c in checks([row | {"own_contacts": 1, "work": 0.5}])] == [False, False]


def test_a_study_of_no_runs_is_refused(capsys):
    assert main(["experiment", "faults", "--seeds", "0"]) == 1
    assert "seeds and jobs must be positive" in capsys.readouterr().err
