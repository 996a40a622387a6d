"""A board's clock on the host's axis: drift, wrap, jitter, reset, and frames held up."""

import re

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


# --- clocks that are none -----------------------------------------------------------------


def told(stamps, rate=45.0, jitter=0.0, begin=50.0):
    """What a clock is said to suffer from after each of these stamps [us]."""
    rng, clock, out = np.random.default_rng(2), DeviceClock(), []
    for i, t in enumerate(stamps):
        arrival = begin + i / rate + rng.uniform(0.0, jitter)
        assert clock.stamp(int(t) % WRAP, arrival) <= arrival
        out.append(clock.trouble)
    return out


GOOD = np.arange(450) * 22_222


@pytest.mark.parametrize(
    ("after", "says"),
    [
        (np.full(450, GOOD[-1]), "stands still"),
        (np.zeros(450), "stands still"),
        (GOOD[::-1], "runs backwards"),
        (WRAP // 2 + np.random.default_rng(0).integers(0, WRAP // 2, 450), "leaps"),
        (GOOD[-1] + np.arange(450) * 2e6, "leaps"),
        (GOOD[-1] + np.arange(900) * 22_222 * 0.5, "runs at 0.5 times"),
        (GOOD[-1] + np.arange(900) * 22_222 * 1.5, "runs at 1.5 times"),
        (GOOD[-1] + np.arange(900) * 22.222, "runs at 0.001 times|stands still"),
    ],
)
def test_a_clock_that_stands_runs_back_leaps_or_runs_otherwise_is_named(after, says):
    words = told(np.concatenate((GOOD, after)))
    assert not any(words[: len(GOOD)])
    assert re.search(says, "|".join(filter(None, words)))
    assert words[-1]  # and it stays so while the clock does


def test_a_good_clock_after_a_bad_one_is_believed_again_after_some_seconds():
    after = GOOD[-1] + 10_000_000 + np.arange(200) * 22_222
    words = told(np.concatenate((GOOD, np.full(90, GOOD[-1]), after)))
    assert words[len(GOOD) + 80] and not words[-1]


@pytest.mark.parametrize(
    "stamps",
    [
        GOOD,
        GOOD + np.random.default_rng(0).integers(-15_000, 15_000, 450),  # sensors in any order
        np.repeat(GOOD[:90] * 5, 5),  # five sensors with one stamp
        np.concatenate((GOOD, np.arange(450) * 22_222)),  # one reset
        WRAP - 4_000_000 + GOOD,  # a wrap
    ],
)
def test_a_clock_that_is_one_is_never_suspected(stamps):
    assert not any(told(np.maximum(stamps, 0), jitter=5e-3))


def test_frames_that_were_held_up_do_not_make_a_clock_a_bad_one():
    clock = DeviceClock()
    for round_ in range(20):  # each second of frames comes at once
        for i in range(45):
            clock.stamp(round((round_ + i / 45) * 1e6), 51.0 + round_)
            assert not clock.trouble
