"""The studies of phantoms and of the filter's frontier, as far as they take no time."""

import numpy as np
import pytest

from app.errors import ConfigError
from app.sensing.budget import HONEST
from app.sensing.truth import draw_truth
from app.studies.frontier import View, ideal
from app.studies.phantoms import ANGLE, CONDITIONS, POSITION, calibrated, choose


def test_an_unknown_condition_is_told_with_those_there_are():
    with pytest.raises(ConfigError, match="as laid out"):
        choose(("calibratd",))
    assert choose(()) == CONDITIONS
    assert [c.name for c in choose(("calibrated",))] == ["calibrated"]


def test_a_calibrated_skin_is_about_as_far_from_the_truth_as_it_says(robot, skin):
    found, true = calibrated(robot, skin, HONEST, 3), draw_truth(robot, skin, HONEST, 3).skin
    off = found.origin - true.origin
    assert np.sqrt(np.mean(off**2)) == pytest.approx(POSITION, rel=0.3)
    turned = np.linalg.norm(found.axis - true.axis, axis=1)  # by two of its three angles
    assert np.sqrt(np.mean(turned**2) / 2.0) == pytest.approx(ANGLE, rel=0.4)
    laid_out = np.linalg.norm(skin.origin - true.origin, axis=1).mean()
    assert np.linalg.norm(off, axis=1).mean() < 0.5 * laid_out


def test_the_ideal_filter_passes_less_and_keeps_less_with_a_larger_threshold(robot, skin):
    views = [View(robot.posture(robot.home), np.arange(3), np.array([0.2, 0.5, 1.0]))]
    rows = [ideal(skin, views, t) for t in (0.0, 0.02, 0.04)]
    assert rows[0]["passed"] == pytest.approx(0.5)
    for key in ("passed", "kept_5_cm"):
        values = [r[key] for r in rows]
        assert values == sorted(values, reverse=True)
    assert rows[-1]["kept_10_cm"] > 0.999
