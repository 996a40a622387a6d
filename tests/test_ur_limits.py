"""What a UR allows of itself: its caps, its pendant's speed slider, its reduced mode, in words."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.robot.ur.limits import LIMITS, REDUCED_SHARE, SPEED, capped, pace, slowed
from app.robot.ur.safety import Report


def said(slider=1.0, scaling=1.0, safety=1, runtime=2):
    return Report(7, safety, 3, runtime, slider, scaling)


def test_an_arm_that_nothing_slows_is_at_its_pace_and_says_nothing():
    assert pace(said()) == 1.0 and slowed(said()) == ""


@pytest.mark.parametrize(
    ("report", "share", "words"),
    [
        (said(slider=0.5), 0.5, "speed slider is at 50 %"),
        (said(slider=0.0), 0.0, "slider is at 0 %; raise it"),
        (said(safety=2), REDUCED_SHARE, "reduced mode: the arm keeps to 24 %"),
        (said(slider=0.5, safety=2), 0.5 * REDUCED_SHARE, "at 50 %; reduced mode"),
        (said(scaling=0.6), 1.0, "controller slows it to 60 %"),
    ],
)
def test_what_slows_the_arm_is_a_pace_and_a_word_for_it(report, share, words):
    assert pace(report) == pytest.approx(share) and words in slowed(report)


def test_a_controller_that_only_follows_its_slider_is_not_told_to_slow_the_arm_itself():
    assert "controller slows" not in slowed(said(slider=0.5, scaling=0.5))
    assert "controller slows" not in slowed(said(scaling=0.0, runtime=1))  # nothing runs


@given(st.floats(-1e3, 1e3), st.sampled_from([1, 2, 3]))
def test_a_pace_is_a_share(slider, safety):
    assert 0.0 <= pace(said(slider=slider, safety=safety)) <= 1.0


@given(st.lists(st.floats(-10.0, 10.0), min_size=6, max_size=6))
def test_the_last_guard_keeps_the_caps_and_the_direction_and_lets_alone_what_keeps_them(qd):
    qd = np.array(qd)
    guarded = capped(qd)
    assert (np.abs(guarded) <= LIMITS.qd_max + 1e-12).all()
    if (np.abs(qd) <= LIMITS.qd_max).all():
        assert (guarded == qd).all()
    else:
        assert np.allclose(guarded * np.abs(qd).max(), qd * SPEED)
