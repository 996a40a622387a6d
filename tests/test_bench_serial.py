"""A whole skin, 450 frames a second over a real pseudo terminal, counted frame by frame."""

import pytest

from app.bench.serial import bench_serial, pattern
from app.setup import Setup


def checks(seconds):
    return {c.name: c for c in bench_serial(Setup(), seconds).checks}


@pytest.mark.slow
def test_no_frame_of_a_whole_skin_is_lost_or_misassigned():
    found = checks(4.0)
    assert found["frames lost"].value == 0
    assert found["frames wrong or misassigned"].value == 0


@pytest.mark.slow
def test_a_minute_of_a_whole_skin_keeps_every_limit():
    found = checks(60.0)
    assert {name: c.value for name, c in found.items() if not c.ok} == {}


def test_every_frame_has_distances_of_its_own():
    seen = {pattern(k, n).tobytes() for k in range(30) for n in range(30)}
    assert len(seen) == 900
