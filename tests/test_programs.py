"""Waypoint programs, straight paths and typed goals."""

import numpy as np
import pytest

from app.actions import RunProgram, SetGoal, SetMode, SetPose
from app.control.path import straight_path
from app.control.programs import ProgramRun, find_program, load_program, shipped_programs
from app.errors import ConfigError
from app.messages import Mode
from app.poses import pose
from app.robot.arm import SimulatedArm
from app.robot.posture import rotation_vector
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.timing import ManualClock
from app.wiring import Start, assemble
from app.world.world import World

TOML = """
title = "two places"
speed_mps = 0.3
{more}
[[waypoint]]
name = "near"
position_m = [0.6, 0.17, 0.55]
rpy_deg = [-90.0, 0.0, -90.0]
dwell_s = 0.2
[[waypoint]]
name = "far"
position_m = [0.6, 0.02, 0.55]
rpy_deg = [-90.0, 0.0, -90.0]
"""


def program(tmp_path, more=""):
    file = tmp_path / "two.toml"
    file.write_text(TOML.format(more=more))
    return load_program(file)


def follow(run, T, seconds, dt=0.01, gain=1.0):
    """A tool that goes a share of the way to the goal in every step."""
    T = T.copy()
    for _ in range(round(seconds / dt)):
        goal = run.update(T, dt).T_base_tool
        T[:3, 3] += gain * (goal[:3, 3] - T[:3, 3])
        T[:3, :3] = goal[:3, :3] if gain else T[:3, :3]
    return T


def test_a_path_is_straight_turns_about_one_axis_and_keeps_both_speeds():
    a, b = pose([0, 0, 0], [0, 0, 0]), pose([0.3, 0.4, 0], [0, 0, np.degrees(1.0)])
    path = straight_path(a, b, 0.25, 0.5)
    assert path.duration == pytest.approx(2.0)
    assert straight_path(a, b, 0.25, 0.1).duration == pytest.approx(10.0)
    middle = path.pose(0.5)
    assert middle[:3, 3] == pytest.approx([0.15, 0.2, 0.0])
    assert rotation_vector(middle[:3, :3]) == pytest.approx([0, 0, 0.5])
    assert np.allclose(path.pose(2.0), b) and np.allclose(path.pose(-1.0), a)


def test_waypoints_are_reached_in_order_with_their_dwell_and_the_program_ends(tmp_path):
    run = ProgramRun(program(tmp_path), pose([0.6, 0.3, 0.55], [-90, 0, -90]))
    assert "1/2 near" in run.words
    T = follow(run, run.update(np.eye(4), 0.0).T_base_tool, 0.9)
    assert "2/2 far" in run.words and run.reached == 1
    follow(run, T, 2.0)
    assert run.done and run.reached == 2


def test_a_loop_begins_anew(tmp_path):
    run = ProgramRun(program(tmp_path, "loop = true"), pose([0.6, 0.3, 0.55], [0, 0, 0]))
    follow(run, pose([0.6, 0.3, 0.55], [0, 0, 0]), 20.0)
    assert not run.done and run.reached > 4


def test_the_goal_waits_on_the_line_for_an_arm_that_had_to_give_way(tmp_path):
    start = pose([0.6, 0.5, 0.55], [-90, 0, -90])
    run = ProgramRun(program(tmp_path), start)
    T = follow(run, start, 0.5)
    T[2, 3] += 0.3  # pushed off the line, and held there
    for _ in range(300):
        goal = run.update(T, 0.01).T_base_tool
    assert np.linalg.norm(goal[:3, 3] - T[:3, 3]) < 0.35  # it has not run on
    assert goal[0, 3] == pytest.approx(0.6) and goal[2, 3] == pytest.approx(0.55)
    follow(run, T, 3.0)
    assert run.reached >= 1


def test_a_place_that_the_tool_is_pushed_from_while_it_stays_is_not_held(tmp_path):
    start = pose([0.6, 0.3, 0.55], [-90, 0, -90])
    run = ProgramRun(program(tmp_path), start)
    near = run.program.waypoints[0]
    while not run._stay > 0.0:
        T = run.update(near.T_base_tool, 0.01).T_base_tool
    away = np.array(T)
    away[2, 3] += 0.3
    for _ in range(200):  # ten times the dwell
        run.update(away, 0.01)
    assert run.reached == 0
    for _ in range(round(near.dwell / 0.01) + 2):
        run.update(near.T_base_tool, 0.01)
    assert run.reached == 1


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("speed_mps = 0.3", "speed_mps = 0.0", "speed_mps"),
        ("[0.6, 0.17, 0.55]", "[0.6, 0.17]", "position_m"),
        ("dwell_s = 0.2", "dwell_s = -1.0", "dwell_s"),
        ("title", "tittle", "tittle"),
        ("0.55", "inf", "position_m = .*; give 3 finite numbers"),
    ],
)
def test_a_bad_program_is_one_line_that_names_the_key(tmp_path, old, new, told):
    file = tmp_path / "bad.toml"
    file.write_text(TOML.format(more="").replace(old, new))
    with pytest.raises(ConfigError, match=told) as e:
        load_program(file)
    assert "\n" not in str(e.value)


def test_an_unknown_program_names_the_known_ones():
    with pytest.raises(ConfigError, match="door-screws"):
        find_program("door-screw")


def test_every_shipped_program_can_be_reached_by_the_arm(robot):
    from app.control.goals import goal_error, goal_twist

    for p in shipped_programs().values():
        for w in p.waypoints:
            q = robot.home
            for _ in range(500):
                posture = robot.posture(q)
                J = posture.tool_jacobian()
                t = goal_twist(posture.T_base_tool, w.T_base_tool, 0.3, 0.6)
                q = q + 0.1 * J.T @ np.linalg.solve(J @ J.T + 1e-4 * np.eye(6), t)
            error, angle = goal_error(robot.posture(q).T_base_tool, w.T_base_tool)
            assert error < 1e-3 and angle < 1e-3, (p.name, w.name)
            assert (q > robot.q_min).all() and (q < robot.q_max).all()


@pytest.fixture
def engine(robot, skin, tmp_path):
    world = World(())
    eye = SimulatedSkin(robot, skin, world, 0, ErrorModel(ideal=True))
    two = program(tmp_path)
    start = Start(programs={"two": two})
    return assemble(robot, skin, SimulatedArm(robot), eye, world, ManualClock(), start, 100)


def run(engine, seconds, *actions):
    for a in actions:
        engine.post(a)
    for _ in range(round(seconds * 100)):
        s = engine.step()
    return s


def test_the_engine_runs_a_program_by_name_and_says_how_far_it_is(engine):
    s = run(engine, 0.5, RunProgram("two"))
    assert s.program.startswith("two 1/2 near")
    assert run(engine, 8.0).program == "two 2/2 far, 2 reached"
    assert "two" in run(engine, 0.1, RunProgram("three")).notice.words


def test_a_dragged_or_typed_goal_ends_the_program(engine):
    run(engine, 0.5, RunProgram("two"))
    s = run(engine, 0.1, SetPose((0.5, 0.1, 0.5), (0.0, 0.0, 1.0)))
    assert s.program == "" and s.goal.T_base_tool[:3, 3] == pytest.approx([0.5, 0.1, 0.5])
    assert s.goal.T_base_tool[1, 0] == pytest.approx(np.sin(1.0))
    run(engine, 0.1, RunProgram("two"))
    assert run(engine, 0.1, SetGoal(s.T_base_tool)).program == ""
    assert run(engine, 0.1, SetPose((np.nan, 0, 0), (0, 0, 0))).notice.refused


def test_a_held_arm_does_not_go_on_with_the_program(engine):
    run(engine, 0.5, RunProgram("two"))
    held = run(engine, 3.0, SetMode(Mode.HOLDING))
    assert np.abs(held.joints.qd).max() < 1e-3 and "1/2" in held.program
    assert "2 reached" in run(engine, 8.0, SetMode(Mode.RUNNING)).program
