"""Whoever adds a controller writes one class with one decorator: it is on the command line, the
page, the plots and in the studies, and it drives the arm.
"""

import json

import numpy as np
import pytest

from app.actions import SetParams
from app.cli import main
from app.config import MODES, Params
from app.control.goals import goal_twist
from app.control.limits import bring_into, velocity_box
from app.control.registry import controller, forget, taking_part
from app.errors import ConfigError
from app.judge.truth import TrueDistance
from app.messages import Command, freeze
from app.plot import plot_tradeoff
from app.studies import tradeoff as study
from app.studies.trial import TrialSpec
from app.studies.world_trial import Stage, condition, run_trial
from tests.ui_page import run, show, snapshot, the_built, the_clock, the_engine, the_page

__all__ = ["the_built", "the_clock", "the_engine", "the_page"]


class Toy:
    """To the goal by damped least squares, the slower the nearer anything is."""

    def __init__(self, robot, clearance):
        self._robot = robot

    def reset(self):
        pass

    def update(self, now):
        p, J = now.params, now.posture.tool_jacobian()
        kept = p.distance_kept
        share = float(np.clip((now.pairs.minimum - kept + 0.05) / 0.1, 0.0, 1.0))
        twist = np.zeros(6)
        if now.goal is not None:
            tool, goal = now.posture.T_base_tool, now.goal.T_base_tool
            twist = share * goal_twist(tool, goal, p.goal_speed, p.goal_turning)
        asked = J.T @ np.linalg.solve(J @ J.T + 1e-3 * np.eye(6), twist)
        speed = p.joint_speed * now.share
        box = velocity_box(self._robot, now.joints.q, speed, now.dt, now.applied)
        qd, _ = bring_into(asked, now.applied, box)
        return Command(freeze(qd), activation=1.0 - share, progress=share)


@pytest.fixture(scope="module", autouse=True)
def toy():
    """Registered by one call, and gone after these tests."""
    controller("toy", "Toy", "the slower the nearer anything is")(Toy)
    yield
    forget("toy")


def test_it_drives_the_arm_from_the_command_line_and_stops_before_the_plate(capsys):
    command = ["run", "--headless", "--seconds", "6", "--rate", "125", "--scene", "front-panel"]
    command += ["--world", "ideal"]  # it knows nothing of phantoms
    assert main([*command, "--mode", "toy", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    row = report["rows"][0]
    assert row["mode"] == "toy" and row["stops"] == [] and row["avoiding_share"] > 0.2
    assert 0.10 < row["min_true_distance_m"] < 0.30
    assert all(c["ok"] for c in report["checks"])


def test_it_is_offered_by_the_help_and_the_errors(capsys):
    with pytest.raises(SystemExit):
        main(["run", "--help"])
    assert "toy" in capsys.readouterr().out and "toy" in MODES
    with pytest.raises(ConfigError, match="toy"):
        Params(mode="nobody")


def test_it_can_be_chosen_on_the_page_and_its_distances_are_drawn(page, engine):
    run(page, page.control.control, "Toy")
    assert engine.posted == [SetParams({"mode": "toy"})]
    now = snapshot(engine, params=Params(mode="toy", distance_kept=0.27))
    show(page, engine, now)
    assert page.control.control.value == "Toy"
    drawn = page.plot.curves
    assert drawn.column("kept_m")[-1] == pytest.approx(0.22)
    assert drawn.column("begins_m")[-1] == pytest.approx(0.32)


@pytest.mark.slow
def test_it_takes_part_in_the_studies_and_in_their_picture(robot, skin, tmp_path, monkeypatch):
    assert {"toy", "qp", "wb"} <= {k.name for k in taking_part("tradeoff")}
    truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
    spec = TrialSpec("worlds", "toy", 3, 1.0, 100.0)
    trial = run_trial(Stage(robot, skin, truth), spec, condition("toy"))
    assert "toy" in {k.name for k in taking_part("worlds")}
    assert trial.finite and not trial.stop and max(trial.speed, trial.reach) <= 1e-9
    only = [k for k in taking_part("tradeoff") if k.name in ("toy", "wb", "qp")]
    monkeypatch.setattr(study, "taking_part", lambda name: only)
    report = study.tradeoff(
        study.Extent(kept=(0.2,), seconds=0.2, cell_seconds=0.2, seeds=1, rate=50.0)
    )
    assert {r["mode"] for r in report.rows} == {"toy", "wb", "wb with memory", "qp"}
    plot_tradeoff(report.rows, tmp_path / "points.svg")
    assert "toy" in (tmp_path / "points.svg").read_text()
