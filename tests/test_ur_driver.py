"""The driver with the real client against the virtual controller, over TCP on loopback."""

import os
import signal
import threading

import numpy as np
import pytest

pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this machine")

from app.errors import RobotError
from app.robot.ur import apart, link, stream
from app.robot.ur.apart import ControlApart
from app.robot.ur.driver import UrArm
from app.robot.ur.limits import ACCELERATION, REDUCED_SHARE, SPEED
from app.virtual.ur.faults import LINKS
from tests.virtual_ur import (
    CLOCK,
    HOME,
    LONGEST,
    ONE,
    VirtualUr,
    drive,
    driven_until,
    own_address,
    standing_after,
    timed_drive,
)


@pytest.fixture
def ur():
    with VirtualUr() as virtual:
        yield virtual


@pytest.fixture(scope="module")
def calm():
    """A virtual UR for tests that leave it as it was."""
    with VirtualUr() as virtual:
        virtual.call("be_patient", 1.0)
        yield virtual


@pytest.fixture(scope="module")
def watched(calm, robot):
    arm = UrArm(calm.host, robot)
    yield arm
    arm.close()


@pytest.fixture(scope="module")
def driven(calm, robot):
    """An arm for tests that leave it well."""
    arm = UrArm(calm.host, robot, armed=True)
    yield arm
    arm.close()


@pytest.fixture
def resting(calm, driven, monkeypatch):
    """The same, at rest, with nothing that slows it; a stall of a busy machine is no matter."""
    monkeypatch.setattr(stream, "STALE", 1.0)
    monkeypatch.setattr(apart, "WATCHDOG", 1.0)
    calm.call("unlock")
    calm.call("set_slider", 1.0)

    def rests(report):
        driven.engage()  # in case that a busy machine was too late for the watchdog
        return report.ready and not report.advice and calm.get("joints_still")

    driven_until(driven, rests)
    return driven


@pytest.fixture
def patient(ur, monkeypatch):
    """A stall of a busy machine stops nothing, where that is not the matter."""
    monkeypatch.setattr(stream, "STALE", 0.5)
    ur.call("be_patient", 1.0)


@pytest.fixture
def moved(ur, robot, patient):
    arm = UrArm(ur.host, robot, armed=True)
    yield arm
    arm.close()


@pytest.fixture
def brisk(ur, robot):
    """An arm with the watchdog that it has outside of the tests, at full speed."""
    arm = UrArm(ur.host, robot, armed=True)
    end = CLOCK.now() + 20.0
    while not (ur.get("playing") and ur.get("fastest") > 0.95 * SPEED):
        assert CLOCK.now() < end, "this machine is too busy to feed the watchdog"
        arm.engage()
        drive(arm, 0.3, SPEED)
    yield arm
    arm.close()


def test_states_come_in_at_200_a_second_and_more(watched):
    best = 0.0
    for _ in range(4):  # a second of a busy machine may be somebody else's
        begin, stamps = CLOCK.now(), set()
        while CLOCK.now() < begin + 1.0:
            stamps.add(watched.state(CLOCK.now()).stamp)
            CLOCK.sleep_until(CLOCK.now() + 0.0005)
        best = max(best, len(stamps) / (CLOCK.now() - begin))
        if best > 200.0:
            break
    assert best > 200.0


def test_the_arm_is_where_the_controller_says_and_its_state_is_young(watched):
    ages = []
    for _ in range(20):
        drive(watched, 0.02)
        state = watched.state(CLOCK.now())
        ages.append(CLOCK.now() - state.stamp)
    assert np.allclose(state.q, HOME) and not state.qd.any()
    assert min(ages) >= 0.0 and np.median(ages) < 0.05


def test_without_arm_nothing_is_ever_sent(calm, watched):
    report, applied = drive(watched, 0.3, 0.5)
    watched.engage()
    drive(watched, 0.3, 0.5)
    assert "monitoring only" in report.advice and report.fault == "" and not applied.any()
    assert (calm.get("commands"), calm.get("uploads"), calm.get("moved_at")) == (0, 0, None)


def test_a_velocity_moves_the_arm_and_zero_brakes_it(resting):
    begin = resting.state(CLOCK.now()).q[3]
    drive(resting, 0.5, 0.3)
    there = resting.state(CLOCK.now())
    assert there.qd[3] == pytest.approx(0.3, abs=0.02) and there.q[3] > begin + 0.08
    drive(resting, 0.3, 0.0)
    assert not resting.state(CLOCK.now()).qd.any()


def test_a_velocity_is_told_when_it_went_out_and_not_before(calm, resting):
    assert not drive(resting, 0.02)[1].any()
    resting.send(0.3 * ONE, 0.004)
    end = CLOCK.now() + 1.0
    while not (applied := resting.applied(CLOCK.now())).any():
        assert CLOCK.now() < end
    assert (applied == 0.3 * ONE).all()
    _, applied = drive(resting, 0.3, 0.2)
    assert (applied == 0.2 * ONE).all() and calm.call("double_in", 3) == 0.2


def test_a_controller_plans_with_the_caps_and_is_not_cut_short_by_them(resting):
    assert (resting.limits.qd_max == SPEED).all() and (resting.limits.qdd_max == ACCELERATION).all()
    _, applied = drive(resting, 0.3, resting.limits.qd_max[3])
    assert (applied == SPEED * ONE).all()


def test_a_velocity_beyond_the_cap_is_slowed_and_that_is_told(resting):
    _, applied = drive(resting, 0.5, 2.0)
    assert applied == pytest.approx(SPEED * ONE)
    assert resting.state(CLOCK.now()).qd.max() == pytest.approx(SPEED, abs=0.02)


def test_the_speed_slider_of_the_pendant_is_a_pace_with_a_word(calm, resting):
    calm.call("set_slider", 0.5)
    report, applied = drive(resting, 0.4, 0.4)
    assert report.pace == 0.5 and "slider is at 50 %" in report.advice and report.ready
    assert applied[3] == 0.4  # what went out; the controller itself slows it
    assert resting.state(CLOCK.now()).qd[3] == pytest.approx(0.2, abs=0.01)
    calm.call("set_slider", 0.0)
    report, _ = drive(resting, 0.4, 0.4)
    assert report.pace == 0.0 and "slider is at 0 %" in report.advice and report.fault == ""
    assert calm.get("joints_still")


def test_reduced_mode_is_a_pace_with_a_word_and_the_arm_goes_on(calm, resting):
    drive(resting, 0.3, SPEED)
    calm.call("reduce")
    report, _ = drive(resting, 0.3, SPEED)
    assert report.pace == REDUCED_SHARE and "reduced mode" in report.advice and report.ready
    assert "controller slows it to 50 %" in report.advice
    assert 0.0 < calm.get("fastest") < 0.5 * SPEED + 0.01
    report, _ = drive(resting, 0.3, report.pace * SPEED)
    assert "controller slows" not in report.advice and not calm.get("joints_still")


def test_an_arm_at_rest_is_sent_no_velocities_but_its_program_lives(calm, resting):
    drive(resting, 0.2, 0.3)
    drive(resting, 0.8, 0.0)
    before = calm.get("commands")
    drive(resting, 0.3, 0.0)
    assert calm.get("commands") == before and calm.get("playing")
    drive(resting, 0.2, 0.3)
    assert resting.state(CLOCK.now()).qd[3] == pytest.approx(0.3, abs=0.02)


def test_the_watchdog_stops_the_arm_when_commands_cease(ur, brisk):
    ceased = ur.get("now")
    CLOCK.sleep_until(CLOCK.now() + 0.5)  # nobody speaks: that is what is tested
    assert "watchdog" in ur.get("log")[-1]
    assert standing_after(ur.get("trace"), ceased) <= 0.2
    assert "control program has ended" in drive(brisk, 0.02)[0].fault


@pytest.mark.parametrize("kind", LINKS)
def test_a_lost_link_stops_the_arm_within_200_ms_and_holds_no_call_up(ur, brisk, kind, monkeypatch):
    monkeypatch.setattr(link, "PATIENCE", 0.5)
    lost = ur.call("break_link", kind, 1.0)
    report, applied, longest = timed_drive(brisk, 0.5, SPEED)
    assert "check the cable" in report.fault and not applied.any()
    called = CLOCK.now()
    brisk.engage()
    longest = max(longest, CLOCK.now() - called, timed_drive(brisk, 0.3, SPEED)[2])
    assert longest < LONGEST
    assert standing_after(ur.get("trace"), lost) <= 0.2


def test_a_client_whose_connection_is_lost_begins_no_program_by_itself(ur):
    control = ControlApart(ur.host, "UR10", threading.Event())

    def order(seconds):
        begin = CLOCK.now()
        for k in range(round(seconds * 250)):
            CLOCK.sleep_until(begin + 0.004 * k)
            now = CLOCK.now()
            control.trouble(now)
            control.send(0.3 * ONE, 0.3 * ONE, 0.004, now)

    order(0.3)
    lost = ur.call("break_link", "drop", 0.003)
    order(0.8)
    assert control.trouble(CLOCK.now()) and not control.sent(CLOCK.now()).any()
    assert ur.get("uploads") == 1 and not ur.get("playing")
    assert standing_after(ur.get("trace"), lost) <= 0.2
    control.close()


@pytest.mark.parametrize("kind", ["drop", "mute", "corrupt"])
def test_after_a_lost_link_the_arm_is_watched_again_and_waits_for_a_person(ur, moved, kind):
    ur.call("be_patient", 0.5)
    drive(moved, 0.3, 0.2)
    ur.call("break_link", kind, 0.8)  # longer than the watchdog is patient
    drive(moved, 0.5, 0.2)
    driven_until(moved, lambda r: "press Run" in r.fault, 0.2)
    drive(moved, 0.3, 0.2)
    assert ur.get("joints_still")
    moved.engage()
    driven_until(moved, lambda r: r.ready, 0.2)
    drive(moved, 0.3, 0.2)
    assert not ur.get("joints_still")


def test_a_protective_stop_is_named_and_ends_the_motion_until_it_is_unlocked(ur, moved):
    drive(moved, 0.2, 0.3)
    ur.call("stop", 3)
    report, applied = drive(moved, 0.2, 0.3)
    assert "protective stop" in report.fault and not applied.any()
    moved.engage()
    assert "protective stop" in drive(moved, 0.3, 0.3)[0].fault
    ur.call("unlock")
    drive(moved, 0.2, 0.3)
    assert ur.get("joints_still")
    moved.engage()
    driven_until(moved, lambda r: r.ready, 0.3)


def refused(ur, robot):
    with pytest.raises(RobotError) as error:
        UrArm(ur.host, robot, armed=True)
    assert (ur.get("uploads"), ur.get("commands")) == (0, 0)
    assert "\n" not in str(error.value) and ur.host in str(error.value)
    return str(error.value)


def test_a_robot_that_is_not_in_remote_control_refuses_before_anything_moves(robot):
    with VirtualUr("local") as ur:
        assert "not in remote control" in refused(ur, robot)


def test_an_older_controller_without_a_remote_switch_is_moved_all_the_same(robot):
    with VirtualUr("cb3") as ur:
        arm = UrArm(ur.host, robot, armed=True)
        try:
            assert arm._stream.major == 3
            driven_until(arm, lambda r: r.ready, 1.0)
        finally:
            arm.close()


def test_a_polyscope_x_controller_is_watched_and_refused_for_motion_by_its_name(robot):
    with VirtualUr("polyscopex") as ur:
        assert "is a PolyScope X controller" in refused(ur, robot)
        arm = UrArm(ur.host, robot)
        try:
            arm.state(CLOCK.now())
            report = arm.report(CLOCK.now())
            assert "monitoring only" in report.advice and not report.fault
        finally:
            arm.close()


def test_a_controller_that_answers_its_version_and_then_nothing_is_refused_in_time(
    robot, monkeypatch
):
    monkeypatch.setattr(link, "PATIENCE", 0.5)
    with VirtualUr("silent") as ur:
        begin = CLOCK.now()
        assert "no answer" in refused(ur, robot)
        assert CLOCK.now() - begin < 2.0


def test_a_client_that_waits_for_ever_while_it_begins_is_ended_in_time(monkeypatch):
    monkeypatch.setattr(apart, "BEGINNING", 1.5)
    with VirtualUr("silent") as ur:
        begin = CLOCK.now()
        with pytest.raises(RobotError, match="no control program began"):
            ControlApart(ur.host, "UR10", threading.Event())
        assert CLOCK.now() - begin < 4.0


def test_leaving_does_not_wait_for_a_client_that_begins():
    leave = threading.Event()
    leave.set()
    with VirtualUr("silent") as ur:
        begin = CLOCK.now()
        with pytest.raises(RobotError):
            ControlApart(ur.host, "UR10", leave)
        assert CLOCK.now() - begin < 4.0


def test_an_arm_that_is_only_watched_needs_no_client_of_the_maker(ur, robot, monkeypatch):
    from app.robot.ur import driver

    monkeypatch.setattr(driver, "find_spec", lambda name: None)
    UrArm(ur.host, robot).close()
    with pytest.raises(RobotError, match=r"install flinch\[ur\]"):
        UrArm(ur.host, robot, armed=True)


def test_a_robot_that_is_switched_off_refuses_before_anything_moves(robot):
    with VirtualUr("off") as ur:
        assert "switch it on" in refused(ur, robot)


def test_another_model_of_arm_is_refused(ur, robot):
    from dataclasses import replace

    assert "is a UR10, not a UR5" in refused(ur, replace(robot, name="ur5e"))


def test_an_address_where_nobody_answers_is_one_line(robot):
    with pytest.raises(RobotError, match="does not answer"):
        UrArm(own_address(), robot)


def test_an_arm_of_seven_joints_is_refused():
    from app.robot.model import find_robot, load_robot

    with pytest.raises(RobotError, match="six joints"):
        UrArm("192.0.2.7", load_robot(find_robot("swan7")))


def test_leaving_brakes_the_arm_and_ends_its_program(ur, moved):
    drive(moved, 0.4, 0.5)
    assert not ur.get("joints_still")
    moved.close()
    assert ur.get("joints_still") and not ur.get("playing")
    assert "asked for by the client" in ur.get("log")[-1]


def test_a_program_that_was_stopped_on_the_pendant_is_named_and_begun_again_by_a_person(ur, moved):
    drive(moved, 0.3, 0.2)
    ur.call("end_program", "on the pendant")
    report, applied = drive(moved, 0.3, 0.2)
    assert "control program has ended" in report.fault and not applied.any()
    moved.engage()
    driven_until(moved, lambda r: r.ready, 0.2)


def test_a_client_that_dies_takes_nothing_with_it_and_the_arm_stands(ur, brisk):
    died = ur.get("now")
    brisk._control._process.kill()
    report, applied = drive(brisk, 0.4, SPEED)
    assert "client has died" in report.fault and "press Run" in report.fault
    assert not applied.any() and standing_after(ur.get("trace"), died) <= 0.2
    brisk.engage()
    driven_until(brisk, lambda r: r.ready, 0.2)


def test_a_client_that_hangs_is_ended_with_a_word_and_what_it_did_not_send_is_not_told(
    ur, moved, monkeypatch
):
    monkeypatch.setattr(apart, "ANSWERING", 0.4)
    drive(moved, 0.3, 0.3)
    os.kill(moved._control._process.pid, signal.SIGSTOP)
    report, applied, longest = timed_drive(moved, 0.2, 0.3)
    assert report.fault == "" and not applied.any()
    report, applied, later = timed_drive(moved, 0.4, 0.3)
    assert "gave no answer" in report.fault and not applied.any()
    assert max(longest, later) < LONGEST
    moved.engage()
    driven_until(moved, lambda r: r.ready, 0.2)
