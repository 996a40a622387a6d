"""`flinch replay` and `flinch compare`: figures, verdicts and refusals, each on one line."""

import json
from dataclasses import replace

import numpy as np
import pytest

from app.cli import main
from app.errors import ConfigError
from app.messages import Mode
from app.record.recorder import start_recording
from app.replay.course import course_of, row_of
from app.replay.summary import beside_ghost, compared
from app.replay.wanted import settings_of
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine
from tests.recorded_run import ACTIONS, kept_run

SETUP = Setup(scene="side-panel", rate=100.0, seed=3)


@pytest.fixture(scope="module")
def run():
    return kept_run(2.0)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    engine = build_engine(SETUP, ManualClock())
    start_recording(engine, SETUP, path, threaded=False, views=False)
    for _ in range(100):
        engine.step()
    engine.close()
    return path


def told(capsys, *args):
    assert main([str(a) for a in args]) == 0
    return capsys.readouterr().out


def refused(capsys, *args):
    assert main([str(a) for a in args]) == 1
    out, err = capsys.readouterr()
    assert err.splitlines()[-1].startswith("flinch: ")
    return out, err


def test_a_recording_is_told_in_figures(capsys, file):
    (row,) = json.loads(told(capsys, "replay", file, "--headless", "--json"))["rows"]
    assert row["ticks"] == 100 and row["seconds"] == pytest.approx(0.99)
    assert row["stops"] == 0 and row["dropped"] == 0 and row["torn"] == ""
    assert 0.0 < row["min_distance_m"] < row["mean_distance_m"]
    assert row["robot"] == "ur10e" and "numpy" in row["packages"]


def test_a_recording_is_verified_and_the_exit_code_tells(capsys, file, monkeypatch):
    assert told(capsys, "replay", file, "--verify").startswith("ok: 100 of 100 ticks")
    monkeypatch.setattr("app.control.bounds.pairs.XI", 0.5)
    out, err = refused(capsys, "replay", file, "--verify", "--json")
    verdict = json.loads(out)
    assert not verdict["ok"] and verdict["difference"]["fields"][0] == "command"
    assert "is not what is computed now" in err


def test_a_torn_file_is_told_as_far_as_it_goes_and_said_so(capsys, file, tmp_path):
    torn = tmp_path / "torn.mcap"
    data = file.read_bytes()
    torn.write_bytes(data[: len(data) * 2 // 3])
    assert main(["replay", str(torn), "--headless", "--json"]) == 0
    out, err = capsys.readouterr()
    (row,) = json.loads(out)["rows"]
    assert "ends early" in err and row["torn"] and 0 < row["ticks"] < 100


def test_what_is_no_recording_and_what_cannot_be_asked_is_refused(capsys, file, tmp_path):
    text = tmp_path / "x.mcap"
    text.write_text("hello")
    refused(capsys, "replay", text, "--headless")
    refused(capsys, "replay", tmp_path / "none.mcap", "--headless")
    assert "wb" in refused(capsys, "replay", file, "--headless", "--ghost", "casper")[1]
    assert "--headless" in refused(capsys, "replay", file, "--json")[1]
    assert "NAME=VALUE" in refused(capsys, "replay", file, "--headless", "--set", "x")[1]
    assert "ends in" in refused(capsys, "replay", file, "--plot", "x.gif")[1]


def test_typed_settings_are_of_their_kind():
    typed = ("distance-kept=0.3", "memory = false", "solver=proxqp", "goal_speed=1")
    expected = {"distance_kept": 0.3, "memory": False, "solver": "proxqp", "goal_speed": 1}
    assert settings_of(typed) == expected
    for bad, says in (
        ("distance_kpet=0.3", "distance_kept"), ("distance_kept=far", "give a number"),
        ("distance_kept=7", "0.05 to 0.4"), ("memory=1", "true or false"), ("d_s=0.3", "is called"),
    ):  # fmt: skip
        with pytest.raises(ConfigError, match=says):
            settings_of((bad,))


def test_a_ghost_is_told_beside_the_recorded_run(run, tmp_path):
    picture = tmp_path / "x.svg"
    report = beside_ghost(run, {"mode": "sm", "distance_kept": 0.35}, picture)
    recorded, ghost = report.rows
    assert "open loop" in report.what
    assert (recorded["name"], ghost["name"]) == ("recorded", "sm, distance_kept 0.35")
    assert ghost["apart_max_rad_s"] > 0.05 and recorded["samples"] == ghost["samples"] == 20
    assert picture.read_text().startswith("<?xml")


def test_a_ghost_with_the_same_settings_asks_for_the_same(run):
    """Nearly: it goes on from what it asked for, the recorded one from what the arm did."""
    ghost = beside_ghost(run, {"mode": "qp"}).rows[1]
    assert ghost["apart_max_rad_s"] < 0.02


def test_two_runs_stand_side_by_side(run, tmp_path):
    other = kept_run(2.0, actions={k: a for k, a in ACTIONS.items() if k != 120})
    report = compared(run, other, ("a", "b"), tmp_path / "x.png")
    a, b = report.rows
    assert (a["name"], a["stops"], b["name"], b["stops"]) == ("a", 1, "b", 0)
    assert set(a) == set(b) and (tmp_path / "x.png").exists()


def test_the_figures_of_a_run_follow_from_its_ticks(run):
    course = course_of(run)
    outs = [out for _, out in run._ticks]
    assert course.distance.tolist() == [o.body.minimum for o in outs]
    assert course.kept[79] == 0.25 and course.kept[80] == 0.3
    row = row_of("x", run, course)
    below = [o.body.minimum < o.params.distance_kept for o in outs]
    assert row["below_kept_s"] == pytest.approx(sum(below[:-1]) * 0.008)  # the last one has no end
    assert row["command_max_rad_s"] == max(float(np.linalg.norm(o.command.qd)) for o in outs)
    smooth = replace(course, qd=np.outer(course.time, np.ones(6)))
    assert row_of("x", run, smooth)["jerk_rms_rad_s3"] < 1e-6 < row["jerk_rms_rad_s3"]
    stopped = replace(course, mode=np.array([Mode.STOPPED] * 250, dtype=object))
    assert row_of("x", run, stopped)["stops"] == 0  # it was never stopped: it stood from the first


def test_compare_is_a_command(capsys, file):
    rows = json.loads(told(capsys, "compare", file, file, "--json"))["rows"]
    assert len(rows) == 2 and rows[0] | {"name": ""} == rows[1] | {"name": ""}
