"""Waypoints that the arm cannot reach: told before the start, with the nearest pose that it can."""

import re

import numpy as np
import pytest

from app.cell.parts import Box, Cell
from app.control.program_reach import reach_words
from app.control.programs import Program, Waypoint
from app.control.stuck import Stuck
from app.messages import Command, Goal, freeze
from app.poses import pose, transform
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine

DOWN = (180.0, 0.0, 0.0)


def program(*places, rpy=DOWN):
    points = [Waypoint(f"w{i}", pose(p, rpy), 0.0) for i, p in enumerate(places)]
    return Program("mine", "mine", tuple(points), 0.02, np.radians(6.0), 0.2, 0.7, False)


def nearest(words):
    """The pose that a line tells."""
    position, rpy = re.findall(r"\[([^\]]*)\]", words)
    read = [np.array([float(v) for v in text.split(",")]) for text in (position, rpy)]
    return read[0], np.radians(read[1])


def test_a_program_within_reach_has_no_words(robot):
    assert (
        reach_words(program((0.6, 0.2, 0.3), (0.6, -0.2, 0.4), (0.3, 0.5, 0.5)), robot, Cell())
        == ()
    )


def test_a_waypoint_too_far_away_is_told_with_a_pose_that_the_arm_has(robot):
    (line,) = reach_words(program((0.6, 0.2, 0.3), (2.5, 0.0, 0.4)), robot, Cell())
    assert line.startswith("mine: waypoint 'w1' cannot be reached: 1.")
    place, _ = nearest(line)
    assert 1.1 < np.linalg.norm(place) < 1.5 and abs(place[1]) < 0.2


def test_millimetres_are_asked_about(robot):
    (line,) = reach_words(program((665.0, 120.0, 250.0)), robot, Cell())
    assert "is it in millimetres?" in line


def test_a_joint_at_its_end_is_named():
    from dataclasses import replace

    from app.choices import build_robot

    robot = build_robot(Setup())
    low, high = robot.q_min.copy(), robot.q_max.copy()
    low[0], high[0] = robot.home[0] - 0.2, robot.home[0] + 0.2
    fenced = replace(robot, q_min=freeze(low), q_max=freeze(high))
    T = robot.posture(robot.home).T_base_tool
    behind = Waypoint("behind", freeze(transform(-T[:3, 3] * [1, 1, -1], np.zeros(3))), 0.0)
    one = Program("mine", "", (behind,), 0.02, 10.0, 0.2, 0.7, False)
    (line,) = reach_words(one, fenced, Cell())
    assert "shoulder_pan_joint" in line and "at the end" in line


def test_a_waypoint_in_the_table_is_told_with_a_pose_before_it(robot):
    table = Box("bench", pose((0.6, 0.0, 0.1), (0, 0, 0)), freeze(np.array([0.6, 3.0, 0.4])))
    cell = Cell("", (table,))
    (line,) = reach_words(program((0.6, 0.2, 0.15)), robot, cell)
    assert "the arm would be in 'bench'" in line
    assert np.isfinite(nearest(line)[0]).all()


@pytest.fixture
def far(tmp_path):
    file = tmp_path / "far.toml"
    file.write_text(
        'title = "far"\n[[waypoint]]\nname = "there"\nposition_m = [2.6, 0.0, 0.3]\n'
        "rpy_deg = [180.0, 0.0, 0.0]\n"
    )
    return file


def test_a_program_out_of_reach_is_told_at_the_start(far):
    engine = build_engine(Setup(scene="empty", program=str(far)), ManualClock())
    assert engine.warnings[0].startswith("far: waypoint 'there' cannot be reached")
    engine.stop()


def test_an_arm_that_cannot_come_nearer_names_the_joint_at_its_end():
    stuck, goal = Stuck(), np.eye(4)
    goal[0, 3] = 1.4
    for t in np.arange(0.0, 5.0, 0.05):
        stuck.goal(Goal(goal), np.eye(4), t)
        stuck.see(np.eye(4), None, Command(np.zeros(6)), False, t, ["elbow_joint"])
    assert stuck.words == "no progress: 1.40 m before the goal, elbow_joint at the end of its range"
    stuck.see(np.eye(4), None, Command(np.full(6, 0.5)), False, 5.0)
    assert stuck.words == ""
