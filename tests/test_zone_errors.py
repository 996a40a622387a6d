"""The bench's own errors of a zone."""

import numpy as np
import pytest

from app.judge.zone_errors import NOISE, ZoneErrors, deviation


def test_reports_scatter_as_recorded_ones_do_and_are_whole_millimetres():
    zones = 4000
    errors = ZoneErrors(zones, np.random.default_rng(1))
    for distance, sigma in NOISE:
        true = np.full(zones, distance)
        one, two = errors.reported(true), errors.reported(true)
        scatter = np.std(one - two) / np.sqrt(2.0)
        assert scatter == pytest.approx(np.hypot(sigma, 1e-3 / np.sqrt(12.0)), rel=0.05)
        assert np.abs(one * 1e3 - np.rint(one * 1e3)).max() < 1e-6
    assert deviation(np.array([0.5])) < deviation(np.array([1.0]))


def test_each_zone_is_always_off_by_the_same_share_and_at_the_lens_by_half_a_centimetre():
    zones = 4000
    errors = ZoneErrors(zones, np.random.default_rng(2))
    mean = np.mean([errors.reported(np.full(zones, 1.0)) for _ in range(30)], axis=0)
    assert np.std(mean - 1.0) == pytest.approx(0.015, rel=0.05)
    near = errors.reported(np.full(zones, 0.02)).mean() - 0.02
    assert near == pytest.approx(0.0045, abs=2e-4)
