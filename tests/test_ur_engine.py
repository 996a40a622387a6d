"""The engine with a UR: the real client against the virtual controller, over TCP on loopback."""

import numpy as np
import pytest

pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this machine")

from app.actions import SetGoal, SetMode
from app.messages import Mode
from app.robot.ur import stream
from app.robot.ur.driver import UrArm
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.timing import WallClock
from app.wiring import assemble
from app.world.world import World
from tests.virtual_ur import VirtualUr, standing_after


@pytest.fixture
def ur():
    with VirtualUr() as virtual:
        yield virtual


@pytest.fixture
def patient(ur, monkeypatch):
    """A stall of a busy machine stops nothing, where that is not the matter."""
    monkeypatch.setattr(stream, "STALE", 0.5)
    ur.call("be_patient", 1.0)


@pytest.fixture
def engine(ur, robot, skin):
    world = World(())
    eye = SimulatedSkin(robot, skin, world, 0, ErrorModel(ideal=True))
    arm = UrArm(ur.host, robot, armed=True)
    engine = assemble(robot, skin, arm, eye, world, WallClock())
    engine.start()
    seen(engine, lambda s: True, limit=100.0)  # a machine that is new to it compiles first
    yield engine
    engine.close()


def seen(engine, wanted, limit=10.0):
    clock = WallClock()
    end = clock.now() + limit
    while clock.now() < end:
        snapshot, _ = engine.snapshots.get()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        clock.sleep_until(clock.now() + 0.01)
    raise AssertionError(f"not within {limit} s; {snapshot and (snapshot.status, snapshot.advice)}")


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


def test_a_lost_link_stops_the_engine_with_a_reason_and_the_arm_stands(ur, patient, engine):
    go(engine, 0.4)
    ur.call("be_patient", 0.0)
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
    engine.close()
    assert ur.get("joints_still") and not ur.get("playing")
