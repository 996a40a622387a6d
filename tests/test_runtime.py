"""The engine on a manual clock: what moves it, what stops it, and what it says about it."""

import numpy as np
import pytest

from app.actions import (
    AddObstacle,
    MoveObstacle,
    RemoveObstacle,
    SetGoal,
    SetMode,
    SetParams,
)
from app.messages import Mode, SensorHealth
from app.robot.arm import SimulatedArm
from app.sensing.error_model import ErrorModel
from app.sensing.schedule import LATENCY
from app.sensing.simulated import SimulatedSkin
from app.timing import ManualClock
from app.wiring import Start, assemble
from app.world.world import World


class Bench:
    """An engine with its parts within reach."""

    def __init__(self, robot, skin, params=None):
        self.world = World(())
        self.arm = SimulatedArm(robot)
        self.eye = SimulatedSkin(robot, skin, self.world, 0, ErrorModel(ideal=True))
        self.clock = ManualClock()
        self.engine = assemble(
            robot, skin, self.arm, self.eye, self.world, self.clock, Start(params=params)
        )

    def run(self, seconds, *actions):
        for a in actions:
            self.engine.post(a)
        for _ in range(round(seconds * 250)):
            snapshot = self.engine.step()
        return snapshot


@pytest.fixture
def bench(robot, skin):
    return Bench(robot, skin)


def shifted(T, x=0.0, y=0.0, z=0.0):
    moved = np.array(T)
    moved[:3, 3] += [x, y, z]
    return moved


def test_the_arm_goes_to_a_goal_that_was_dragged(bench):
    start = bench.run(0.2).T_base_tool
    end = bench.run(4.0, SetGoal(shifted(start, z=0.1)))
    assert end.T_base_tool[2, 3] == pytest.approx(start[2, 3] + 0.1, abs=0.005)
    assert end.status.mode is Mode.RUNNING


def test_an_obstacle_is_perceived_only_through_the_sensors(bench, robot, skin):
    start = bench.run(0.3, SetParams({"memory": False}))
    assert start.body.closest == -1
    forearm = start.T_base_link[robot.link_index("forearm_link")]
    beside = forearm[:3, :3] @ [-0.3, 0.25, 0.04] + forearm[:3, 3]
    seen = bench.run(0.3, AddObstacle("ball", {"kind": "sphere", "radius_m": 0.05}, tuple(beside)))
    assert 0.0 < seen.body.minimum < 0.3
    for k in range(skin.count):
        bench.eye.muted.add(k)
    blind = bench.run(0.3)  # the frames are stale by now, the ball is still there
    assert blind.body.closest == -1


def test_the_arm_gives_way_to_an_obstacle_that_comes_near(bench, robot):
    start = bench.run(0.3)
    forearm = start.T_base_link[robot.link_index("forearm_link")]
    beside = forearm[:3, :3] @ [-0.3, 0.17, 0.04] + forearm[:3, 3]
    before = bench.run(
        0.2, AddObstacle("ball", {"kind": "sphere", "radius_m": 0.05}, tuple(beside))
    )
    after = bench.run(2.0)
    assert before.command.activation > 0.0
    assert after.body.minimum > before.body.minimum + 0.03
    assert np.linalg.norm(after.joints.q - start.joints.q) > 0.05


def test_stop_brakes_and_stands_still_until_a_person_says_run(bench):
    start = bench.run(0.2).T_base_tool
    bench.run(0.5, SetGoal(shifted(start, y=-0.3)))
    stopped = bench.run(0.5, SetMode(Mode.STOPPED))
    still = bench.run(0.5)
    assert np.array_equal(stopped.joints.q, still.joints.q) or np.allclose(
        stopped.joints.q, still.joints.q, atol=1e-6
    )
    assert still.status.reason == "asked for by a person"
    moving = bench.run(0.5, SetMode(Mode.RUNNING))
    assert np.linalg.norm(moving.joints.qd) > 0.01


def test_hold_keeps_the_place_and_ignores_the_goal(bench):
    start = bench.run(0.2).T_base_tool
    bench.run(0.1, SetMode(Mode.HOLDING), SetGoal(shifted(start, y=-0.3)))
    assert np.allclose(bench.run(1.0).T_base_tool[:3, 3], start[:3, 3], atol=0.002)


def test_silent_sensors_stop_the_arm_with_their_number(bench, skin):
    start = bench.run(0.3).T_base_tool
    bench.run(0.2, SetGoal(shifted(start, y=-0.3)))
    bench.eye.muted.update(range(skin.count))
    stopped = bench.run(1.2)
    assert stopped.status.mode is Mode.STOPPED
    assert stopped.status.reason == "15 of 30 sensors silent for more than 0.5 s"
    assert np.abs(stopped.joints.qd).max() < 1e-6
    assert (stopped.health == SensorHealth.STALE).all()


def test_after_a_fault_only_a_person_sets_it_going_and_a_lasting_one_stops_it_again(bench, skin):
    bench.run(0.3)
    bench.eye.muted.update(range(skin.count))
    bench.run(1.0)
    again = bench.run(0.9, SetMode(Mode.RUNNING))
    assert again.status.mode is Mode.STOPPED and "silent" in again.status.reason
    bench.eye.muted.clear()
    assert bench.run(1.0).status.mode is Mode.STOPPED
    assert bench.run(1.0, SetMode(Mode.RUNNING)).status.mode is Mode.RUNNING


def test_a_stall_of_the_machine_itself_waits_for_fresh_frames_and_goes_on(bench):
    start = bench.run(0.3).T_base_tool
    bench.run(0.5, SetGoal(shifted(start, y=-0.5)))
    bench.clock.t += 1.0
    after = bench.run(0.02)
    assert after.status.mode is Mode.RUNNING
    assert np.linalg.norm(after.command.qd) < np.linalg.norm(bench.run(0.4).command.qd)


def test_one_dead_sensor_is_shown_and_does_not_stop_the_arm(bench):
    bench.run(0.3)
    bench.eye.muted.add(4)
    s = bench.run(1.0)
    assert s.status.mode is Mode.RUNNING
    # ideal sensors before an arm at rest repeat themselves, and are called frozen for it
    speaking = np.isin(s.health, [SensorHealth.GOOD, SensorHealth.FROZEN])
    assert s.health[4] == SensorHealth.STALE and speaking.sum() == 29


def test_an_exception_in_a_room_stops_the_arm_with_its_name(bench, monkeypatch):
    start = bench.run(0.3).T_base_tool
    bench.run(0.3, SetGoal(shifted(start, y=-0.3)))

    def broken(*_):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(bench.eye, "poll", broken)
    stopped = bench.run(0.5)
    assert stopped.status.mode is Mode.STOPPED
    assert "a bug" in stopped.status.reason and "ZeroDivisionError" in stopped.status.reason
    assert np.abs(stopped.joints.qd).max() < 1e-3


def test_a_joint_value_that_is_not_finite_stops_the_arm(bench, robot, monkeypatch):
    from app.messages import JointState

    bench.run(0.3)
    bad = JointState(0.3, np.full(6, np.nan), np.zeros(6))
    monkeypatch.setattr(bench.arm, "state", lambda now: bad)
    assert "not finite" in bench.run(0.02).status.reason


def test_a_range_that_is_not_finite_is_no_point_and_no_fault(bench, robot, skin, monkeypatch):
    from tests.fakes import frame

    bench.run(0.3)
    monkeypatch.setattr(
        bench.eye, "poll", lambda now, posture: [frame(k, now, np.nan) for k in range(30)]
    )
    s = bench.run(0.1)
    assert s.body.closest == -1 and np.isfinite(s.command.qd).all()


def test_settings_change_between_ticks_and_bad_ones_are_refused_with_a_notice(bench):
    assert bench.run(0.02, SetParams({"distance_kept": 0.3, "mode": "sm"})).params.mode == "sm"
    refused = bench.run(0.02, SetParams({"distance_kept": 9.0}))
    assert refused.params.distance_kept == 0.3 and "0.05 to 0.4" in refused.notice.words
    assert bench.run(0.02, SetParams({"nonsense": 1})).notice.refused
    assert bench.run(0.02, SetParams({"distance_kept": 0.2})).notice.words == ""


def test_obstacles_are_added_moved_and_removed(bench):
    ball = AddObstacle("", {"kind": "sphere", "radius_m": 0.1}, (1, 0, 0))
    names = [b.view.name for b in bench.run(0.02, ball).world]
    assert len(names) == 1
    T = np.eye(4)
    T[:3, 3] = [0.0, 1.0, 0.5]
    assert np.allclose(bench.run(0.02, MoveObstacle(names[0], T)).world[0].T_base_body, T)
    assert bench.run(0.02, RemoveObstacle(names[0])).world == ()
    assert "nobody" in bench.run(0.02, RemoveObstacle("nobody")).notice.words


@pytest.mark.parametrize("bad", [np.full((4, 4), np.nan), np.eye(3)])
def test_a_goal_that_is_no_pose_is_refused(bench, bad):
    before = bench.run(0.02).goal
    after = bench.run(0.02, SetGoal(bad))
    assert after.goal is before and "4x4" in after.notice.words


def test_what_was_seen_is_remembered_when_the_sensors_look_away(bench, robot, skin):
    forearm = bench.run(0.3).T_base_link[robot.link_index("forearm_link")]
    beside = forearm[:3, :3] @ [-0.3, 0.25, 0.04] + forearm[:3, 3]
    bench.run(0.3, AddObstacle("ball", {"kind": "sphere", "radius_m": 0.05}, tuple(beside)))
    for k in range(skin.count):
        bench.eye.muted.add(k)
    blind = bench.run(0.3)  # the frames are stale by now
    assert 0.0 < blind.body.minimum < 0.3 and len(blind.memory) > 0


def test_speed_and_separation_knows_how_old_each_measurement_is(bench, robot):
    forearm = bench.run(0.3).T_base_link[robot.link_index("forearm_link")]
    beside = forearm[:3, :3] @ [-0.3, 0.25, 0.04] + forearm[:3, 3]
    ball = AddObstacle("ball", {"kind": "sphere", "radius_m": 0.05}, tuple(beside))
    seen = bench.run(0.3, ball, SetParams({"mode": "ssm", "memory": False}))
    known = seen.pairs.slot >= 0
    assert known.any() and np.isinf(seen.pairs.age[~known]).all()
    assert (seen.pairs.age[known] >= LATENCY - 1e-9).all()
    assert (seen.pairs.age[known] <= 0.2).all()  # three frames
    assert seen.command.protective > seen.params.person_speed * seen.params.reaction_time


def test_the_controller_can_be_switched_while_running(bench, robot):
    assert bench.run(0.3).pairs.distance.shape == (4 * len(robot.links),)
    assert bench.run(0.1, SetParams({"mode": "sm"})).pairs.distance.shape == (30,)
    assert bench.run(0.1, SetParams({"mode": "wb"})).pairs.distance.shape == (len(robot.links),)


def test_a_control_thread_that_dies_is_a_named_stop(bench, monkeypatch):
    bench.run(0.1)

    def dead(*_):
        raise MemoryError("none left")

    monkeypatch.setattr(bench.engine, "step", dead)
    bench.engine.start()
    bench.engine._thread.join(timeout=10)
    bench.engine.stop()
    status = bench.engine.snapshots.get()[0].status
    assert status.mode is Mode.STOPPED and "has died" in status.reason


def test_the_thread_runs_and_ends(robot, skin):
    from app.timing import WallClock

    world = World(())
    eye = SimulatedSkin(robot, skin, world, 0, ErrorModel(ideal=True))
    engine = assemble(robot, skin, SimulatedArm(robot), eye, world, WallClock())
    engine.start()
    first = None
    while first is None or first.tick < 5:
        first = engine.snapshots.get()[0]
    with pytest.raises(RuntimeError, match="runs already"):
        engine.start()
    engine.stop()
    last = engine.snapshots.get()[0].tick
    assert engine.snapshots.get()[0].tick == last >= 5
