"""The driver with the real client against the virtual controller, over TCP on loopback."""

import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this machine")

from app.actions import SetGoal, SetMode
from app.errors import RobotError
from app.messages import Mode
from app.robot.ur.control import SPEED
from app.robot.ur.driver import UrArm
from app.robot.ur.emulator.controller import standing_after
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.timing import WallClock
from app.wiring import assemble
from app.world.world import World
from tests.virtual_ur import HOME, VirtualUr, own_address

ONE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])


@pytest.fixture
def ur():
    with VirtualUr() as virtual:
        yield virtual


def drive(arm, seconds, speed=0.0):
    """What an engine does with its arm; returns the last report and the last velocity applied."""
    clock = WallClock()
    begin = clock.now()
    report = applied = None
    for k in range(round(seconds * 250)):
        clock.sleep_until(begin + 0.004 * k)
        arm.state(clock.now())
        report = arm.report(clock.now())
        applied = arm.send(speed * ONE, 0.004)
    return report, applied


def driven_until(arm, wanted, speed=0.0, limit=10.0):
    """Drive until the report is as wanted; fails after a while."""
    for _ in range(round(limit / 0.02)):
        report, _ = drive(arm, 0.02, speed)
        if wanted(report):
            return report
    raise AssertionError(f"not within {limit} s; the arm says {report}")


@pytest.fixture
def watched(ur, robot):
    arm = UrArm(ur.host, robot)
    yield arm
    arm.close()


@pytest.fixture
def patient(ur):
    """A watchdog that a stall of a busy machine does not set off, where it is not the matter."""
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
    clock = WallClock()
    end = clock.now() + 20.0
    while not (ur.get("playing") and ur.get("fastest") > 0.95 * SPEED):
        assert clock.now() < end, "this machine is too busy to feed the watchdog"
        arm.engage()
        drive(arm, 0.3, SPEED)
    yield arm
    arm.close()


def test_states_come_in_at_200_a_second_and_more(watched):
    clock = WallClock()
    best = 0.0
    for _ in range(4):  # a second of a busy machine may be somebody else's
        begin, stamps = clock.now(), set()
        while clock.now() < begin + 1.0:
            stamps.add(watched.state(clock.now()).stamp)
            clock.sleep_until(clock.now() + 0.0005)
        best = max(best, len(stamps) / (clock.now() - begin))
        if best > 200.0:
            break
    assert best > 200.0


def test_the_arm_is_where_the_controller_says_and_its_state_is_young(watched):
    clock = WallClock()
    ages = []
    for _ in range(20):
        drive(watched, 0.02)
        state = watched.state(clock.now())
        ages.append(clock.now() - state.stamp)
    assert np.allclose(state.q, HOME) and not state.qd.any()
    assert min(ages) >= 0.0 and np.median(ages) < 0.05


def test_without_arm_nothing_is_ever_sent(ur, watched):
    report, applied = drive(watched, 0.3, 0.5)
    watched.engage()
    drive(watched, 0.3, 0.5)
    assert "monitoring only" in report.advice and report.fault == "" and not applied.any()
    assert (ur.get("commands"), ur.get("uploads"), ur.get("moved_at")) == (0, 0, None)


def test_a_velocity_moves_the_arm_and_zero_brakes_it(moved):
    drive(moved, 0.5, 0.3)
    before = moved.state(WallClock().now())
    assert before.qd[3] == pytest.approx(0.3, abs=0.02) and before.q[3] > HOME[3] + 0.08
    drive(moved, 0.3, 0.0)
    assert not moved.state(WallClock().now()).qd.any()


def test_a_velocity_beyond_the_cap_is_slowed_and_that_is_told(moved):
    _, applied = drive(moved, 0.5, 2.0)
    assert applied == pytest.approx(SPEED * ONE)
    assert moved.state(WallClock().now()).qd.max() == pytest.approx(SPEED, abs=0.02)


def test_an_arm_at_rest_is_sent_no_velocities_but_its_program_lives(ur, moved):
    drive(moved, 0.3, 0.3)
    drive(moved, 1.0, 0.0)
    before = ur.get("commands")
    drive(moved, 0.5, 0.0)
    assert ur.get("commands") == before and ur.get("playing")
    drive(moved, 0.3, 0.3)
    assert moved.state(WallClock().now()).qd[3] == pytest.approx(0.3, abs=0.02)


def test_the_watchdog_stops_the_arm_when_commands_cease(ur, brisk):
    ceased = ur.get("now")
    time.sleep(0.5)  # nobody speaks: that is what is tested
    assert "watchdog" in ur.get("log")[-1]
    assert standing_after(ur.get("trace"), ceased) <= 0.2
    assert "control program has ended" in drive(brisk, 0.02)[0].fault


@pytest.mark.parametrize("kind", ["drop", "mute"])
def test_a_lost_link_stops_the_arm_within_200_ms(ur, brisk, kind):
    lost = ur.call("break_link", kind, 1.0)
    report, applied = drive(brisk, 0.5, SPEED)
    assert "check the cable" in report.fault and not applied.any()
    assert standing_after(ur.get("trace"), lost) <= 0.2


@pytest.mark.parametrize("kind", ["drop", "mute"])
def test_after_a_lost_link_the_arm_is_watched_again_and_waits_for_a_person(ur, moved, kind):
    drive(moved, 0.3, 0.2)
    ur.call("break_link", kind, 1.5)  # longer than the watchdog is patient here
    drive(moved, 0.5, 0.2)
    driven_until(moved, lambda r: "press Run" in r.fault, 0.2)
    drive(moved, 0.3, 0.2)
    assert ur.get("joints_still")
    moved.engage()
    driven_until(moved, lambda r: r.ready, 0.2)
    drive(moved, 0.3, 0.2)
    assert not ur.get("joints_still")


def test_a_protective_stop_is_named_and_ends_the_motion_until_it_is_unlocked(ur, moved):
    drive(moved, 0.4, 0.3)
    ur.call("stop", 3)
    assert "protective stop" in drive(moved, 0.3, 0.3)[0].fault
    moved.engage()
    assert "protective stop" in drive(moved, 0.5, 0.3)[0].fault
    ur.call("unlock")
    drive(moved, 0.3, 0.3)
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
    assert "connection is lost" in report.fault or "press Run" in report.fault
    assert not applied.any() and standing_after(ur.get("trace"), died) <= 0.2
    brisk.engage()
    driven_until(brisk, lambda r: r.ready, 0.2)


# --- with the engine ------------------------------------------------------------------------


@pytest.fixture
def engine(ur, robot, skin):
    world = World(())
    eye = SimulatedSkin(robot, skin, world, 0, ErrorModel(ideal=True))
    arm = UrArm(ur.host, robot, armed=True)
    engine = assemble(robot, skin, arm, eye, world, WallClock())
    engine.start()
    yield engine
    engine.stop()


def seen(engine, wanted, limit=10.0):
    clock = WallClock()
    end = clock.now() + limit
    while clock.now() < end:
        snapshot, _ = engine.snapshots.get()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        clock.sleep_until(clock.now() + 0.01)
    raise AssertionError(f"not within {limit} s; {snapshot.status} {snapshot.advice}")


def run(engine, limit=20.0):
    """Press Run until the arm moves: a busy machine may be too late for the watchdog at first."""
    clock = WallClock()
    end = clock.now() + limit
    while clock.now() < end:
        engine.post(SetMode(Mode.RUNNING))
        settled = clock.now() + 2.0
        while clock.now() < settled:
            snapshot, _ = engine.snapshots.get()
            if snapshot.status.mode is Mode.RUNNING and np.abs(snapshot.joints.qd).max() > 0.1:
                return snapshot
            clock.sleep_until(clock.now() + 0.01)
    raise AssertionError(f"not within {limit} s; {snapshot.status} {snapshot.advice}")


def go(engine, up):
    T = np.array(seen(engine, lambda s: s.status.mode is not Mode.IDLE).T_base_tool)
    T[2, 3] += up
    engine.post(SetGoal(T))
    return run(engine)


def test_the_goal_is_the_present_pose_until_a_person_says_where_to_go(ur, patient, engine):
    running = seen(engine, lambda s: s.status.mode is Mode.RUNNING)
    assert np.allclose(running.goal.T_base_tool, running.T_base_tool, atol=1e-4)
    go(engine, 0.2)
    assert ur.get("moved_at") is not None


def test_a_lost_link_stops_the_engine_with_a_reason_and_the_arm_stands(ur, engine):
    go(engine, 0.4)
    ur.call("break_link", "drop", 1.0)
    lost = ur.get("now")
    stopped = seen(engine, lambda s: s.status.mode is Mode.STOPPED)
    assert "connection is lost" in stopped.status.reason
    ticks = stopped.tick
    seen(engine, lambda s: s.tick > ticks + 125)
    assert standing_after(ur.get("trace"), lost) <= 0.2
    # states come in again, the arm waits for a person
    seen(engine, lambda s: s.joints.stamp > stopped.joints.stamp + 0.5)
    assert seen(engine, lambda s: True).status.mode is Mode.STOPPED and ur.get("joints_still")
    run(engine)
    assert not ur.get("joints_still")


def test_stop_brakes_the_real_arm_and_run_moves_it_on(ur, patient, engine):
    go(engine, 0.4)
    engine.post(SetMode(Mode.STOPPED))
    seen(engine, lambda s: s.status.mode is Mode.STOPPED and not s.joints.qd.any())
    assert ur.get("playing")
    run(engine)


def test_ending_the_engine_ends_the_program(ur, patient, engine):
    go(engine, 0.4)
    engine.stop()
    assert ur.get("joints_still") and not ur.get("playing")


def test_a_virtual_controller_begins_and_ends_by_its_command():
    host = own_address()
    command = [sys.executable, "-m", "app", "ur", "emulate", "--host", host, "--seconds", "0.2"]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert result.returncode == 0 and host in result.stdout and result.stderr == ""
