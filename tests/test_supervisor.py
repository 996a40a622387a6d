"""The supervisor: who may change what, and how the arm slows and stops when it grows blind."""

import itertools

import numpy as np
import pytest

from app.actions import SetGoal, SetMode
from app.config import Params
from app.control.supervisor import Ask, Fault, Ready, after, speed_share
from app.messages import Mode, Status
from tests.test_runtime import Bench, shifted


@pytest.mark.parametrize("mode", list(Mode))
def test_only_a_person_ends_a_stop(mode):
    stopped = Status(Mode.STOPPED, "blind", 1.0)
    assert after(stopped, Ready(), 2.0) is stopped
    assert after(stopped, Fault("something else"), 2.0) is stopped
    assert after(stopped, Ask(mode, "a person"), 2.0) == Status(mode, "a person", 2.0)


@pytest.mark.parametrize("mode", [m for m in Mode if m is not Mode.STOPPED])
def test_a_fault_stops_from_everywhere_with_its_reason(mode):
    assert after(Status(mode, "", 0.0), Fault("dark"), 3.0) == Status(Mode.STOPPED, "dark", 3.0)


def test_an_idle_arm_begins_when_it_sees_and_no_other_does():
    assert after(Status(Mode.IDLE, "", 0.0), Ready(), 1.0).mode is Mode.RUNNING
    holding = Status(Mode.HOLDING, "", 0.0)
    assert after(holding, Ready(), 1.0) is holding


def test_every_change_has_a_reason_and_a_time():
    events = (Ready(), Ask(Mode.RUNNING, "r"), Ask(Mode.HOLDING, "h"), Fault("f"))
    for mode, event in itertools.product(Mode, events):
        old = Status(mode, "before", 0.0)
        new = after(old, event, 5.0)
        assert new is old or (new.reason and new.since == 5.0)


def test_the_speed_falls_linearly_from_slow_to_stop():
    shares = [speed_share(a, 0.2, 0.5) for a in (0.0, 0.2, 0.35, 0.5, 9.0)]
    assert shares == pytest.approx([1.0, 1.0, 0.5, 0.0, 0.0])
    assert speed_share(0.3, 0.4, 0.3) == 0.0 and speed_share(0.29, 0.4, 0.3) == 1.0


@pytest.mark.parametrize("mode", ["wb", "multi", "qp"])
def test_a_silence_of_200_ms_slows_and_of_500_ms_stops_within_the_limits(robot, skin, mode):
    """Measured in the simulated arm, from the last measurement on."""
    bench = Bench(robot, skin, Params(mode=mode, goal_speed=0.6))
    start = bench.run(0.3).T_base_tool
    moving = bench.run(0.8, SetGoal(shifted(start, y=-0.8)))
    full = np.abs(moving.joints.qd).max()
    bench.eye.muted.update(range(skin.count))
    before, last_frame, speed, change = moving, np.nan, {}, 0.0
    for _ in range(300):
        s = bench.run(0.004)
        last_frame = np.median(s.cloud.stamp)
        change = max(
            change, np.abs(s.joints.qd - before.joints.qd).max() / (s.stamp - before.stamp)
        )
        speed[round(s.stamp - last_frame, 3)] = np.abs(s.joints.qd).max()
        before = s
        if 0.3 < s.stamp - last_frame < 0.4:
            assert "silent" in s.advice and s.status.mode is Mode.RUNNING
    at = np.array(sorted(speed))
    assert full > 0.2 and speed[at[at > 0.18][0]] > 0.6 * full
    assert speed[at[at > 0.40][0]] < 0.9 * full
    assert speed[at[at > 0.65][0]] < 0.02 * full and speed[at[-1]] < 1e-3
    assert change <= robot.qdd_max.max() + 1e-6
    assert before.status.mode is Mode.STOPPED and "silent" in before.status.reason


def test_sensors_that_speak_again_in_time_give_the_speed_back(robot, skin):
    bench = Bench(robot, skin)
    start = bench.run(0.3).T_base_tool
    bench.run(0.5, SetGoal(shifted(start, y=-0.8)))
    bench.eye.muted.update(range(skin.count))
    slowed = bench.run(0.4)
    bench.eye.muted.clear()
    again = bench.run(0.4)
    assert slowed.advice and not again.advice and again.status.mode is Mode.RUNNING
    assert np.abs(again.joints.qd).max() > np.abs(slowed.joints.qd).max()


def test_before_the_first_frame_the_arm_is_idle_and_still(robot, skin):
    bench = Bench(robot, skin)
    first = bench.run(0.004, SetGoal(shifted(robot.posture(robot.home).T_base_tool, y=-0.3)))
    assert first.status.mode is Mode.IDLE and np.abs(first.command.qd).max() == 0.0
    assert bench.run(0.3).status.mode is Mode.RUNNING
    assert bench.run(0.01, SetMode(Mode.IDLE)).status.mode is Mode.IDLE
