"""A board's clock on the host's axis: drift, wrap, jitter, reset, and frames held up."""

import numpy as np
import pytest

from app.sensing.device_clock import DeviceClock

WRAP = 1 << 32
SHORTEST = 1e-4  # [s] of the delays below


def run(clock, seconds, ppm=0.0, start_us=0, begin=50.0, rate=45.0, jitter=1e-3, seed=1):
    """Errors of the stamps [s] over a run of a board that was switched on at `begin`."""
    rng = np.random.default_rng(seed)
    errors = []
    for i in range(int(seconds * rate)):
        t = begin + i / rate
        t_us = (start_us + round((t - begin) * (1e6 + ppm))) % WRAP
        arrival = t + SHORTEST + rng.exponential(jitter)
        stamp = clock.stamp(t_us, arrival)
        assert stamp <= arrival
        errors.append(stamp - t)
    return np.array(errors)


@pytest.mark.parametrize("ppm", [-100.0, 0.0, 100.0])
def test_a_drift_of_100_ppm_is_found_and_taken_out(ppm):
    clock = DeviceClock()
    errors = run(clock, 300.0, ppm)
    assert clock.drift * 1e6 == pytest.approx(-ppm, abs=2.0)
    assert np.abs(errors).max() < 8e-3  # before anything is known: the first frame's own delay
    assert np.abs(errors[20 * 45 :] - SHORTEST).max() < 2e-4


def test_the_wrap_of_the_32_bit_clock_is_not_seen():
    clock = DeviceClock()
    errors = run(clock, 60.0, ppm=50.0, start_us=WRAP - 30_000_000)
    assert clock.restarts == 0
    assert np.abs(errors[900:] - SHORTEST).max() < 3e-4


def test_a_silence_longer_than_a_wrap_is_bridged():
    clock = DeviceClock()
    run(clock, 30.0)
    silence = 2.0 * WRAP * 1e-6 + 1000.0
    errors = run(clock, 30.0, start_us=round((30.0 + silence) * 1e6), begin=80.0 + silence)
    assert clock.restarts == 0 and np.abs(errors[450:] - SHORTEST).max() < 5e-4


def test_a_board_that_was_reset_begins_anew():
    clock = DeviceClock()
    run(clock, 30.0, start_us=700_000_000)
    errors = run(clock, 30.0, start_us=0, begin=95.0)
    assert clock.restarts == 1
    assert np.abs(errors[90:] - SHORTEST).max() < 1e-3


def test_a_machine_that_lags_for_seconds_does_not_take_old_frames_for_fresh():
    clock = DeviceClock()
    run(clock, 10.0)
    stamps = [clock.stamp(10_000_000 + i * 22_222, 60.8 + i / 45) for i in range(6 * 45)]
    assert np.allclose(stamps, 60.0 + np.arange(6 * 45) / 45, atol=2e-3)


def test_a_reset_that_looks_like_lateness_is_found_within_some_seconds():
    clock = DeviceClock()
    run(clock, 3.0)
    errors = run(clock, 30.0, start_us=4_000_000, begin=63.0)
    assert clock.restarts == 1
    assert np.abs(errors[12 * 45 :] - SHORTEST).max() < 1e-3


def test_frames_that_were_held_up_keep_their_own_times():
    clock = DeviceClock()
    run(clock, 30.0, jitter=1e-4)
    # for 1.5 s nothing came through; then all of it at once
    late = [clock.stamp(round((30.0 + i / 45) * 1e6), 81.5) for i in range(67)]
    assert np.abs(np.array(late) - (80.0 + np.arange(67) / 45)).max() < 1e-3
    assert clock.restarts == 0


def test_frames_in_another_order_keep_their_own_times():
    clock = DeviceClock()
    run(clock, 30.0, jitter=1e-4)
    first = clock.stamp(30_100_000, 80.1002)
    second = clock.stamp(30_060_000, 80.1004)
    assert (first, second) == pytest.approx((80.1001, 80.0601), abs=2e-4)
