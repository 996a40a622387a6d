"""Simulated range errors beside those of real sensors."""

import os
from pathlib import Path

import numpy as np
import pytest

from app.cli import main
from app.studies.range_errors import noise_of, range_errors

DATA = Path(os.environ.get("FLINCH_DATA", Path(__file__).parents[2] / "shared" / "data")) / "tof"


def test_the_noise_of_a_steady_motion_is_found_and_its_steps_are_not():
    rng, t = np.random.default_rng(2), np.arange(400)[:, None]
    d = 1.0 - 0.004 * t + 0.3 * (t > 200) + 0.006 * rng.standard_normal((400, 64))
    d[rng.random(d.shape) < 0.1] = np.nan
    assert np.median(noise_of(d)) == pytest.approx(0.006, rel=0.05)


def test_simulated_ranges_err_as_published():
    report = range_errors(frames=60, seeds=2)
    assert len(report.checks) > 20
    missed = [c.name for c in report.checks if not c.ok and "klux" not in c.name]
    assert missed == []  # shares of 90 % need more frames than a test has


@pytest.mark.skipif(not DATA.is_dir(), reason=f"the recorded logs are not here ({DATA})")
def test_simulated_noise_is_that_of_recorded_frames():
    report = range_errors(frames=30, seeds=1, data=DATA)
    assert sum("recorded" in r for r in report.rows) >= 5
    assert all(c.ok for c in report.checks if c.name.endswith("times recorded"))


def test_a_folder_that_is_none_is_told(capsys):
    assert main(["experiment", "ranges", "--data", "/nowhere"]) == 1
    assert "is no folder" in capsys.readouterr().err
