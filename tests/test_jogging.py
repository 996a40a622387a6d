"""The arm moved by hand: asked for, done as far as is clear, and at rest when nobody asks."""

import re

import numpy as np
import pytest

from app.actions import (
    AddObstacle,
    GoHome,
    Jog,
    JogJoints,
    SetGoal,
    SetMode,
    SetParams,
    SetPose,
    Want,
)
from app.config import MODES, Params
from app.control.jogging import LAPSE, Jogging
from app.control.registry import kinds
from app.messages import JointState, Mode
from app.robot.arm import SimulatedArm
from app.robot.model import find_robot, load_robot
from app.robot.skin_file import load_skin
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.timing import ManualClock
from app.wiring import Start, assemble
from app.world.scene import find_scene, load_scene
from app.world.world import World

RATE = 100.0
BASE = np.eye(3)


@pytest.fixture(scope="module")
def robot():
    return load_robot(find_robot("ur10e"))


@pytest.fixture
def arm(robot):
    return arm_in(robot, "empty")


def arm_in(robot, scene, **params):
    """A running arm that has seen its first frames."""
    scene = load_scene(find_scene(scene))
    skin, world = load_skin(robot.folder / robot.skin, robot), World(scene.bodies)
    source = SimulatedSkin(robot, skin, world, errors=ErrorModel())
    engine = assemble(
        robot, skin, SimulatedArm(robot), source, world, ManualClock(),
        Start(scene.cell, Params(**params)), RATE,
    )  # fmt: skip
    ticks(engine, 0.4)
    assert engine.step().status.mode is Mode.RUNNING
    return engine


def ticks(engine, seconds, ask=None):
    """The last of so many ticks, asked for as a held button does: twenty times a second."""
    for i in range(max(round(seconds * RATE), 1)):
        if ask is not None and i % 5 == 0:
            engine.post(ask)
        last = engine.step()
    return last


def along(x=0.0, y=0.0, z=0.0, a=0.0, b=0.0, c=0.0, axes=BASE):
    return Jog((x, y, z, a, b, c), axes)


def speed(snapshot, robot):
    """(6,) of the tool, by the command."""
    return robot.posture(snapshot.joints.q).tool_jacobian() @ snapshot.command.qd


@pytest.mark.parametrize("mode", sorted({"qp", "wb", "sm", "multi", "paper", "ssm"}))
def test_every_controller_moves_the_tool_as_it_is_asked(robot, mode):
    assert mode in kinds() and mode in MODES
    arm = arm_in(robot, "empty", mode=mode)
    last = ticks(arm, 0.4, along(z=1.0))
    assert speed(last, robot) == pytest.approx([0.0, 0.0, 0.3, 0.0, 0.0, 0.0], abs=0.01)
    assert last.granted.share == pytest.approx(1.0, abs=0.03) and last.granted.by == ""
    assert last.status.mode is Mode.HOLDING and last.status.reason == "moved by a person"


def test_a_joint_turns_alone_and_no_faster_than_the_tool_may_move(arm, robot):
    last = ticks(arm, 0.6, JogJoints((-1.0, 0, 0, 0, 0, 0)))
    others = np.delete(last.command.qd, 0)
    assert np.abs(others).max() < 1e-9 and last.command.qd[0] < -0.1
    assert np.linalg.norm(speed(last, robot)[:3]) <= 0.3 + 1e-6
    last = ticks(arm, 0.6, JogJoints((0, 0, 0, 0, 0, 1.0)))
    assert last.command.qd[5] == pytest.approx(0.6)  # the turning that the settings allow


def test_axes_of_the_tool_turn_with_it(arm, robot):
    last = ticks(arm, 0.6, along(z=1.0, axes=None))
    z = last.T_base_tool[:3, 2]
    assert speed(last, robot)[:3] == pytest.approx(0.3 * z, abs=5e-3)


def test_slower_settings_and_smaller_shares_are_slower(arm, robot):
    arm.post(SetParams({"goal_speed": 0.1}))
    last = ticks(arm, 0.6, along(z=0.5))
    assert speed(last, robot)[2] == pytest.approx(0.05, abs=1e-4)


def test_a_corner_is_no_faster_than_a_side(arm, robot):
    last = ticks(arm, 0.5, along(y=-1.0, z=1.0))
    assert np.linalg.norm(speed(last, robot)[:3]) == pytest.approx(0.3, abs=1e-3)


def test_the_first_tick_after_the_first_message_moves_the_arm(arm):
    arm.post(along(z=1.0))
    assert np.abs(arm.step().command.qd).max() > 0.0


def test_a_wish_lapses_by_itself_and_the_arm_rests_within_its_limits(arm, robot):
    ticks(arm, 0.6, along(y=-1.0))
    before = arm.step().command.qd
    asked_last = arm.step().stamp
    moving_until, place = 0.0, None
    for _ in range(round(1.5 * RATE)):
        last = arm.step()
        assert np.abs(last.command.qd - before).max() <= robot.qdd_max[0] / RATE + 1e-9
        before = last.command.qd
        if last.granted is not None and last.granted.wish.twist[1] < -1e-6:
            moving_until = last.stamp
        if last.granted is None and place is None:
            place = last.T_base_tool[:3, 3].copy()
    assert LAPSE <= 0.3 and moving_until - asked_last <= 0.3 + 0.15
    assert np.abs(last.command.qd).max() < 1e-3
    assert last.status.mode is Mode.HOLDING
    assert last.goal.T_base_tool[:3, 3] == pytest.approx(place, abs=0.005)
    assert last.T_base_tool[:3, 3] == pytest.approx(place, abs=0.005)


def test_a_key_that_is_let_go_ends_it_at_once(arm):
    ticks(arm, 0.6, along(y=-1.0))
    last = ticks(arm, 0.2, along())
    assert np.abs(last.granted.wish.twist if last.granted else 0.0).max() == 0.0


def test_run_after_a_jog_stays_where_it_was_left(arm):
    ticks(arm, 0.6, along(y=-1.0))
    left = ticks(arm, 1.5)
    arm.post(SetMode(Mode.RUNNING))
    last = ticks(arm, 1.0)
    assert last.status.mode is Mode.RUNNING
    assert last.T_base_tool[:3, 3] == pytest.approx(left.T_base_tool[:3, 3], abs=0.003)


@pytest.mark.parametrize("wish", [along(y=1.0), JogJoints((1.0,) * 6), Want(qd=np.ones(6))])
def test_an_arm_that_is_stopped_does_not_move_and_says_so(arm, wish):
    arm.post(SetMode(Mode.STOPPED))
    ticks(arm, 0.5)
    last = ticks(arm, 0.3, wish)
    assert np.abs(last.command.qd).max() == 0.0 and last.status.mode is Mode.STOPPED
    assert last.notice.refused and "press Run or Hold" in last.notice.words


def test_stop_ends_a_jog_and_it_does_not_come_back(arm):
    ticks(arm, 0.5, along(y=-1.0))
    arm.post(SetMode(Mode.STOPPED))
    ticks(arm, 0.05)
    arm.post(SetMode(Mode.HOLDING))
    last = ticks(arm, 0.3)
    assert last.granted is None and last.status.mode is Mode.HOLDING


@pytest.mark.parametrize(
    "wish",
    [
        Jog((1.0, 0.0)), Jog((np.nan,) * 6), Jog((1.0,) * 6, np.ones((3, 3))), JogJoints((1.0,)),
        Want(), Want(qd=np.ones(5)), Want(twist=np.full(6, np.inf)),
        Want(twist=np.ones(6), qd=np.ones(6)),
    ],
)  # fmt: skip
def test_rubbish_is_refused_and_moves_nothing(arm, wish):
    last = ticks(arm, 0.2, wish)
    assert last.notice.refused and last.granted is None and last.status.mode is Mode.RUNNING


def test_a_new_goal_ends_a_jog(arm):
    ticks(arm, 0.4, along(y=-1.0))
    arm.post(SetPose((0.6, 0.1, 0.5), (-1.57, 0.0, -1.57)))
    last = ticks(arm, 0.1)
    assert last.granted is None
    assert last.goal.T_base_tool[:3, 3] == pytest.approx([0.6, 0.1, 0.5])


def test_home_brings_the_joints_there_while_it_runs(arm, robot):
    last = arm.step()
    goal = last.T_base_tool.copy()
    goal[:3, 3] += [0.0, 0.15, 0.1]
    arm.post(SetGoal(goal))
    ticks(arm, 3.0)
    arm.post(GoHome())
    last = ticks(arm, 5.0)
    assert last.joints.q == pytest.approx(robot.home, abs=0.01)
    assert last.granted is None and last.status.mode is Mode.RUNNING


def test_what_is_in_the_way_holds_a_jog_and_is_named(arm):
    """Straight at a ball until it holds the arm: slowed first, and never much nearer than kept."""
    place = arm.step().T_base_tool[:3, 3] + [0.0, -0.7, 0.0]
    arm.post(AddObstacle("ball", {"kind": "sphere", "radius_m": 0.15}, tuple(place)))
    for _ in range(40):
        last = ticks(arm, 0.1, along(y=-1.0))
        if last.granted.share < 0.2:
            break
    assert last.granted.share < 0.2
    near = re.search(r"^[a-z ]+\d?, (\d+) cm from what is in the way$", last.granted.by)
    assert near and 20 <= int(near[1]) <= 30


def test_a_pose_that_a_program_wants_is_gone_to(arm, robot):
    T = arm.step().T_base_tool.copy()
    T[:3, 3] += [0.0, 0.1, 0.1]
    last = ticks(arm, 5.0, Want(T_base_tool=T))
    assert last.T_base_tool[:3, 3] == pytest.approx(T[:3, 3], abs=2e-3)


@pytest.mark.parametrize("n", [6])
def test_what_a_program_wants_passes_unchanged_where_nothing_is_near(arm, robot, n):
    qd = np.linspace(-0.2, 0.3, n)
    last = ticks(arm, 0.3, Want(qd=qd))
    assert last.command.qd == pytest.approx(qd, abs=1e-9)
    twist = np.array([0.05, -0.1, 0.05, 0.1, 0.0, -0.1])
    last = ticks(arm, 0.3, Want(twist=twist))
    assert speed(last, robot) == pytest.approx(twist, abs=1e-9)


def test_a_wish_is_the_same_after_a_state_was_kept_and_put_back(arm):
    ticks(arm, 0.2, along(y=-1.0))
    kept = arm.brain.capture()
    written = arm.brain.written(kept)
    before = arm.brain.digest()
    ticks(arm, 0.3)
    arm.brain.restore(kept)
    assert arm.brain.digest() == before
    arm.brain.restore(arm.brain.read(written))
    assert arm.brain.digest() == before


def test_the_ramp_reaches_the_whole_and_comes_back_in_its_time(robot):
    jog, q = Jogging(robot), robot.home
    posture = robot.posture(q)
    still = JointState(0.0, q, np.zeros(6))
    jog.ask(along(x=1.0), 0.0)
    seen = [jog.update(0.01 * i, 0.01, posture, still, Params()) for i in range(1, 60)]
    speeds = np.array([0.0 if w is None else w.twist[0] for w in seen])
    assert np.abs(np.diff(speeds)).max() <= 0.3 * 0.01 / 0.15 + 1e-9
    assert speeds.max() == pytest.approx(0.3) and seen[-1] is None
