"""A reflex for others: what is wanted passes where nothing is near, and gives way where it is."""

from types import SimpleNamespace

import numpy as np
import pytest

import flinch
from app.actions import AddObstacle, Jog, Want
from app.bench.guard import bench_guard
from app.messages import JointState, Mode
from app.reflex import Guard, JointSpeeds, Pose, Twist
from app.robot.arm import SimulatedArm
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.studies.random_scene import random_goal, random_world
from app.studies.trial import TrialSpec
from app.studies.world_trial import (
    NEW_GOAL,
    Found,
    _engine,
    _Watch,
    condition,
    run_trial,
    stage,
)
from app.timing import ManualClock
from app.wiring import Start, assemble
from app.world.scene import find_scene, load_scene
from app.world.world import World

DT = 0.01
BALL = {"kind": "sphere", "radius_m": 0.12}


class Arm:
    """A simulated arm with its skin, as somebody else's program would have it."""

    def __init__(self, guard, bodies=None):
        scene = load_scene(find_scene("empty"))
        self.guard, self.world = guard, World(bodies if bodies is not None else scene.bodies)
        self.q, self.now = guard.robot.home.copy(), 0.0
        self.qd = np.zeros(guard.robot.n)
        self.skin = SimulatedSkin(guard.robot, guard.skin, self.world, errors=ErrorModel())

    def step(self, wanted, seconds=DT):
        """Move as the guard says; the last command."""
        for _ in range(max(round(seconds / DT), 1)):
            self.now += DT
            joints = JointState(self.now, self.q.copy(), self.qd.copy())
            frames = self.skin.poll(self.now, self.guard.robot.posture(self.q)) if self.skin else ()
            self.command = self.guard.step(frames, joints, wanted)
            self.qd = np.array(self.command.qd)
            self.q = self.q + DT * self.qd
        return self.command

    def twist(self):
        return self.guard.robot.posture(self.q).tool_jacobian() @ self.qd


@pytest.fixture(scope="module")
def cell():
    return load_scene(find_scene("empty")).cell


@pytest.fixture(scope="module")
def built():
    return Guard.of("ur10e")


@pytest.fixture
def guard(built, cell):
    return Guard(built.robot, built.skin, cell)


def test_before_the_first_frames_nothing_moves_and_the_reason_is_told(guard):
    arm = Arm(guard)
    first = arm.step(JointSpeeds(np.full(6, 0.1)))
    assert not first.qd.any() and "waits for the first frames" in first.reason
    assert not first.stopped


def test_joint_speeds_pass_unchanged_where_nothing_is_near(guard):
    arm, qd = Arm(guard), np.linspace(-0.2, 0.3, 6)
    command = arm.step(JointSpeeds(qd), 0.6)
    assert np.abs(command.qd - qd).max() <= 1e-9 and command.reason == ""
    assert command.share == pytest.approx(1.0)


def test_a_twist_passes_unchanged_where_nothing_is_near(guard):
    arm, twist = Arm(guard), np.array([0.05, -0.1, 0.05, 0.1, 0.0, -0.1])
    arm.step(None, 0.3)
    for _ in range(30):
        posture = guard.robot.posture(arm.q)
        command = arm.step(Twist(twist))
    assert posture.tool_jacobian() @ command.qd == pytest.approx(twist, abs=1e-9)
    assert command.reason == ""


def test_a_pose_is_gone_to(guard):
    arm = Arm(guard)
    T = guard.robot.posture(arm.q).T_base_tool.copy()
    T[:3, 3] += [0.0, 0.1, 0.05]
    arm.step(Pose(T), 4.0)
    assert guard.robot.posture(arm.q).T_base_tool[:3, 3] == pytest.approx(T[:3, 3], abs=2e-3)


def test_more_than_the_joints_can_is_cut_to_their_limits_and_said(guard):
    arm = Arm(guard)
    arm.step(None, 0.3)
    command = arm.step(JointSpeeds(np.full(6, 0.4)))
    assert np.abs(command.qd).max() <= guard.robot.qdd_max[0] * DT + 1e-9
    assert "limits of speed" in command.reason and 0.0 < command.share < 1.0


def test_nothing_wanted_any_more_is_rest(guard):
    arm = Arm(guard)
    arm.step(JointSpeeds(np.full(6, 0.2)), 0.6)
    command = arm.step(None, 1.5)
    assert np.abs(command.qd).max() < 0.01 and command.reason == ""


def test_a_ball_holds_a_policy_that_drives_at_it(guard):
    arm = Arm(guard)
    arm.step(None, 0.3)
    tool = guard.robot.posture(arm.q).T_base_tool[:3, 3]
    arm.world.add("ball", BALL, (tool[0], tool[1] - 0.7, tool[2]))
    twist = np.array([0.0, -0.3, 0.0, 0.0, 0.0, 0.0])
    for _ in range(300):
        command = arm.step(Twist(twist))
        if command.share < 0.1:
            break
    assert command.share < 0.1 and "cm from what is in the way" in command.reason


def test_silent_sensors_stop_it_until_somebody_resumes(guard):
    arm = Arm(guard)
    arm.step(JointSpeeds(np.full(6, 0.1)), 0.5)
    skin, arm.skin = arm.skin, None
    command = arm.step(JointSpeeds(np.full(6, 0.1)), 1.2)
    assert command.stopped and "silent" in command.reason and not command.qd.any()
    arm.skin = skin
    assert arm.step(JointSpeeds(np.full(6, 0.1)), 0.3).stopped  # frames alone do not start it
    guard.resume()
    command = arm.step(JointSpeeds(np.full(6, 0.1)), 0.5)
    assert not command.stopped and command.qd == pytest.approx(np.full(6, 0.1), abs=1e-9)


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        (JointSpeeds(np.ones(5)), "give (6,)"), (Twist(np.full(6, np.nan)), "all finite"),
        (Pose(np.ones((3, 3))), "give (4, 4)"),
    ],
)  # fmt: skip
def test_rubbish_moves_nothing_and_is_told(guard, wanted, told):
    arm = Arm(guard)
    arm.step(None, 0.3)
    command = arm.step(wanted)
    assert told in command.reason and np.abs(command.qd).max() < 1e-6


def test_time_only_goes_on(guard):
    arm = Arm(guard)
    arm.step(None)
    with pytest.raises(flinch.FlinchError, match="give a later"):
        guard.step((), JointState(arm.now, arm.q, arm.qd), None)


def test_frames_are_made_by_the_names_of_the_layout(guard):
    sensor = guard.skin.sensors[3]
    d = np.full(64, 0.5)
    d[7] = np.nan
    frame = guard.frame(sensor.name, 1.0, d.reshape(8, 8))
    assert frame.sensor == 3 and frame.targets[7] == 0 and frame.targets.sum() == 63
    assert guard.frame(sensor.name, 1.1, d).sequence == frame.sequence + 1
    with pytest.raises(flinch.FlinchError, match="64 zones, not 3"):
        guard.frame(sensor.name, 1.0, np.ones(3))
    with pytest.raises(flinch.FlinchError, match="no sensor 'nose'"):
        guard.frame("nose", 1.0, d)


def test_the_same_inputs_give_the_same_commands_as_a_jog_on_the_page(guard, cell):
    """A jog beside a ball, tick by tick to the last bit."""
    robot, skin = guard.robot, guard.skin
    world = World(load_scene(find_scene("empty")).bodies)
    engine = assemble(
        robot, skin, SimulatedArm(robot), SimulatedSkin(robot, skin, world, errors=ErrorModel()),
        world, ManualClock(), Start(cell, begin=Mode.HOLDING), 100.0,
    )  # fmt: skip
    seen = []
    engine.follow(SimpleNamespace(put=seen.append, close=seen.clear))
    place = robot.posture(robot.home).T_base_tool[:3, 3] + [0.0, -0.6, 0.0]
    engine.post(AddObstacle("ball", BALL, tuple(place)))
    for i in range(200):
        if i >= 40 and i % 5 == 0:
            engine.post(Jog((0.0, -1.0, 0.3, 0.0, 0.0, 0.0), np.eye(3)))
        engine.step()
    held_back = 0
    for x, out in seen:
        wish = out.granted.wish if out.granted else None
        joints = JointState(x.now, x.joints.q, x.joints.qd)
        command = guard.step(x.frames, joints, Twist(wish.twist) if wish else None, x.applied)
        assert np.array_equal(command.qd, out.command.qd)
        held_back += bool(out.granted and out.granted.share < 0.9)
    assert held_back > 20  # or the ball was not in the way


def test_each_public_name_is_at_one_path_and_all_of_them_are_there():
    assert {name for name in flinch.__all__ if not hasattr(flinch, name)} == set()
    with pytest.raises(AttributeError, match="it has Command"):
        flinch.Gaurd  # noqa: B018
    with pytest.raises(AttributeError):
        flinch.Engine  # noqa: B018


def driven(seed, seconds):
    """What an arm touches in a random world when a policy drives it straight at its goals."""
    spec = TrialSpec("worlds", "QP", seed, seconds)
    parts, rng = stage(), np.random.default_rng([seed, 7])
    world = random_world(parts.robot, parts.truth, rng)
    goals = [random_goal(parts.robot, rng) for _ in range(int(seconds / NEW_GOAL) + 2)]
    engine, found = _engine(parts, spec, condition("QP"), world, goals[0]), Found()
    watch, snapshot = _Watch(found, engine, parts.truth, spec.rate), engine.step()
    while found.touch is None and snapshot.stamp < seconds:
        engine.post(Want(T_base_tool=goals[int(snapshot.stamp / NEW_GOAL)].T_base_tool))
        snapshot = engine.step()
        watch.update(snapshot)
    engine.close()
    return found


def touched(seeds, seconds):
    """How many worlds a policy touches, and how many the controller with goals of its own."""
    policy = [driven(seed, seconds) for seed in seeds]
    own = [
        run_trial(stage(), TrialSpec("worlds", "QP", seed, seconds), condition("QP"))
        for seed in seeds
    ]
    for found in policy:
        assert found.finite and max(found.speed, found.change, found.reach) < 1e-9
    return sum(bool(f.touch) for f in policy), sum(bool(f.touch) for f in own)


def test_a_policy_touches_no_more_than_the_controllers_own_way_does():
    policy, own = touched(range(1), 2.0)
    assert policy <= own


@pytest.mark.slow
def test_in_many_worlds_a_policy_touches_no_more_than_the_controllers_own_way_does():
    policy, own = touched(range(40), 10.0)
    assert policy <= own


def test_the_benchmark_measures_whole_steps():
    report = bench_guard(Setup(scene="empty", rate=50.0), 0.4)
    assert [row["name"] for row in report.rows] == ["step", "step, processor's time"]
    assert report.checks[0].name == "step with 30 sensors, median"
