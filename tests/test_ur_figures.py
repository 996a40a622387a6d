"""The driver's figures against the virtual controller: rates, calls, ways, stops (`-s` shows)."""

import numpy as np
import pytest

pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this machine")

from app.robot.ur.driver import UrArm
from app.robot.ur.limits import SPEED
from app.timing import WallClock
from tests.virtual_ur import VirtualUr, standing_after

pytestmark = pytest.mark.slow
CLOCK = WallClock()


def drive(arm, seconds, speed):
    """A loop of 250 Hz; the arm's velocities seen [(time, rad/s)], and a tick's calls [s]."""
    begin, seen, calls = CLOCK.now(), [], []
    qd = np.array([0.0, 0.0, 0.0, speed, 0.0, 0.0])
    for k in range(round(250 * seconds)):
        CLOCK.sleep_until(begin + 0.004 * k)
        called = CLOCK.now()
        state = arm.state(called)
        seen.append((CLOCK.now(), state.qd[3]))
        arm.report(called)
        arm.send(qd, 0.004)
        calls.append(CLOCK.now() - called)
    return seen, calls


def at_speed(arm, ur, speed):
    """Ask for motion as a person would, until the arm is at speed; fails after a while."""
    end = CLOCK.now() + 20.0
    while not (ur.get("playing") and ur.get("fastest") > 0.95 * abs(speed)):
        assert CLOCK.now() < end, "this machine is too busy to feed the watchdog"
        arm.engage()
        drive(arm, 0.4, speed)


def show(name, values, unit, scale=1e3):
    p50, p99 = np.percentile(values, [50, 99]) * scale
    print(
        f"\n{name}: median {p50:.2f}, p99 {p99:.2f}, max {max(values) * scale:.2f} {unit}", end=""
    )


def test_states_come_in_for_20_s_without_a_hole(robot):
    with VirtualUr() as ur:
        arm = UrArm(ur.host, robot)
        begin, stamps, ages = CLOCK.now(), [], []
        while CLOCK.now() < begin + 20.0:
            stamp = arm.state(CLOCK.now()).stamp
            ages.append(CLOCK.now() - stamp)
            if not stamps or stamp > stamps[-1]:
                stamps.append(stamp)
            CLOCK.sleep_until(CLOCK.now() + 0.0005)
        arm.close()
    rate = len(stamps) / 20.0
    print(f"\nstates: {rate:.0f} a second", end="")
    show("age of the newest state", ages, "ms")
    assert rate >= 200.0


def test_a_velocity_is_sent_quickly_and_obeyed_soon(robot):
    with VirtualUr() as ur:
        ur.call("be_patient", 1.0)  # the watchdog is not the matter here
        arm = UrArm(ur.host, robot, armed=True)
        calls, ways = [], []
        for k in range(40):
            asked = CLOCK.now()
            seen, called = drive(arm, 0.25, 0.2 if k % 2 == 0 else -0.2)
            if k == 0:
                continue  # it sets the watchdog
            calls += called
            before = seen[0][1]
            ways.append(next(t - asked for t, v in seen if abs(v - before) > 0.01))
        arm.close()
    show("calls of a tick", calls, "ms")
    show("from the call to a state that shows the change", ways, "ms")
    assert np.median(calls) < 0.002 and np.median(ways) < 0.030


@pytest.mark.parametrize("kind", ["drop", "mute", "silence"])
def test_an_arm_at_full_speed_stands_200_ms_after_the_link_is_lost(robot, kind):
    stood = []
    with VirtualUr() as ur:
        arm = UrArm(ur.host, robot, armed=True)
        for sign in (1, -1) * 5:
            at_speed(arm, ur, sign * SPEED)
            if kind == "silence":  # our side stands still
                lost = ur.get("now")
                CLOCK.sleep_until(CLOCK.now() + 0.5)
            else:
                lost = ur.call("break_link", kind, 0.6)
                drive(arm, 0.5, sign * SPEED)
            stood.append(standing_after(ur.get("trace"), lost))
        arm.close()
    show(f"{kind}: from the loss to the standing arm", stood, "ms")
    assert len(stood) == 10 and max(stood) <= 0.2
