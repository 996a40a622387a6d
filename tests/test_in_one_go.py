"""Frames that were measured at about one time are judged together."""

import numpy as np
import pytest

from app.perception.perception import in_one_go
from app.perception.uncertainty import TOGETHER, known_of
from tests.fakes import frame


def test_frames_within_a_millisecond_are_judged_in_one_go_and_in_order():
    stamps = [0.0103, 0.0, 0.0004, 0.0009, 0.0012, 0.0111, 0.5]
    groups = in_one_go([frame(k, t) for k, t in enumerate(stamps)])
    assert [[f.sensor for f in g] for g in groups] == [[1, 2, 3], [4], [0, 5], [6]]


def test_no_frame_is_off_by_more_than_its_doubt_says(skin):
    rng = np.random.default_rng(0)
    for _ in range(50):
        for g in in_one_go([frame(k, t) for k, t in enumerate(rng.uniform(0.0, 0.01, 12))]):
            middle = (g[0].stamp + g[-1].stamp) / 2.0
            assert max(abs(f.stamp - middle) for f in g) <= TOGETHER / 2.0
    known = known_of(skin)
    assert known.time == pytest.approx(np.hypot(skin.doubt.time, TOGETHER / 2.0))
    assert (known.time < 1.04 * skin.doubt.time).all()


def test_nothing_is_judged_in_no_go():
    assert in_one_go([]) == []
