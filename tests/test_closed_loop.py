"""The paper's claim, on the simulated arm: the whole body keeps clear, not only the sensors."""

import numpy as np
import pytest

from app.config import Params
from app.setup import Setup
from app.studies.headless import run, summary


def steady_true_distance(scene, mode, seconds=6.0):
    record, _ = run(
        Setup(scene=scene, seed=3, rate=125.0, world="ideal"), seconds, Params(mode=mode)
    )
    return record.steady(2.0)


def test_before_a_front_panel_whole_body_stays_10_cm_farther_than_sensor_mounts():
    wb = steady_true_distance("front-panel", "wb")
    sm = steady_true_distance("front-panel", "sm")
    assert wb - sm >= 0.10
    assert 0.20 < wb < 0.30  # where it acts fully .. where it begins


def test_beside_a_side_panel_whole_body_stays_10_cm_farther_than_sensor_mounts():
    wb = steady_true_distance("side-panel", "wb")
    sm = steady_true_distance("side-panel", "sm")
    assert wb - sm >= 0.10


def test_the_same_seed_gives_the_same_run():
    a, last_a = run(Setup(seed=7), 1.0)
    b, last_b = run(Setup(seed=7), 1.0)
    assert a.true_distance == b.true_distance
    assert np.array_equal(last_a.joints.q, last_b.joints.q)


def test_a_summary_has_the_figures_and_their_checks():
    report = summary(Setup(scene="empty"), 0.5)
    row = report.rows[0]
    assert row["ticks"] == pytest.approx(126, abs=1)
    assert row["stops"] == [] and row["status"] == "running"
    assert all(c.ok for c in report.checks)
