"""A blocked goal: noticed, said, and escaped from within bounds, only where that is allowed."""

import numpy as np
import pytest

from app.config import Params
from app.control.goals import goal_error
from app.control.stuck import ASIDE, DETOUR, PAUSE, Stuck
from app.messages import Command, Goal, Pairs
from app.robot.arm import SimulatedArm
from tests.alone import alone

N = np.array([[-1.0, 0.0, 0.0]])
WALL = Pairs(
    np.array([6]), np.array([0.25]), np.zeros((1, 3)), 0.25 * -N, N, np.zeros(1, dtype=int), 0
)


def pose(x=0.0, y=0.0):
    T = np.eye(4)
    T[:3, 3] = [x, y, 0.5]
    return T


def goals_of_a_blocked_arm(escape, seconds=60.0, held=0):
    """The goals handed on while a tool at the origin cannot reach x = 0.3, and what is said."""
    stuck, out, words = Stuck(), [], []
    for t in np.arange(0.0, seconds, 0.05):
        out.append(stuck.goal(Goal(pose(0.3)), pose(), t))
        stuck.see(pose(), WALL, Command(np.zeros(6), control_row=held), escape, t)
        words.append(stuck.words)
    return np.array([g.T_base_tool[:3, 3] for g in out]), words


def test_a_blocked_arm_says_so_and_keeps_its_goal_unless_it_may_escape():
    places, words = goals_of_a_blocked_arm(escape=False)
    assert (places == [0.3, 0.0, 0.5]).all()
    assert words[20] == "" and "blocked" in words[60] and "blocked" in words[-1]


def test_an_escape_is_short_near_rare_and_ends_after_each_side_was_tried():
    places, words = goals_of_a_blocked_arm(escape=True, seconds=200.0)
    aside = (places != [0.3, 0.0, 0.5]).any(axis=1)
    begins = np.flatnonzero(np.diff(aside.astype(int)) == 1) + 1
    ends = np.flatnonzero(np.diff(aside.astype(int)) == -1) + 1
    assert len(begins) == 8 and not aside[-1] and "blocked" in words[-1]
    assert (0.05 * (ends - begins) <= DETOUR + 0.1).all()
    assert (0.05 * np.diff(begins) >= PAUSE).all()
    moved = places[aside] - [0.0, 0.0, 0.5]
    assert np.linalg.norm(moved, axis=1).max() <= max(ASIDE) + 1e-9
    assert np.abs(moved[:, 0]).max() < 1e-9  # across the wall's normal
    assert len(np.unique(moved.round(6), axis=0)) == 8


def test_an_arm_that_nothing_holds_or_that_gets_on_is_not_blocked():
    places, words = goals_of_a_blocked_arm(escape=True, held=-1)
    assert (places == [0.3, 0.0, 0.5]).all()
    assert set(words) == {"", "no progress: 0.30 m before the goal, the goal is out of reach"}
    stuck = Stuck()
    for t in np.arange(0.0, 20.0, 0.05):
        tool = pose(-0.5 + 0.02 * t)
        stuck.goal(Goal(pose(0.3)), tool, t)
        stuck.see(tool, WALL, Command(np.zeros(6), control_row=0), True, t)
        assert stuck.words == ""


def test_a_new_goal_begins_anew():
    stuck = Stuck()
    for t in np.arange(0.0, 4.0, 0.05):
        stuck.goal(Goal(pose(0.3)), pose(), t)
        stuck.see(pose(), WALL, Command(np.zeros(6), control_row=0), True, t)
    assert stuck.words
    stuck.goal(Goal(pose(-0.3)), pose(), 4.0)
    assert stuck.words == ""


@pytest.mark.parametrize("escape", [False, True])
def test_a_post_before_the_goal_is_never_come_too_near_by_an_escape(robot, escape):
    """Perfect sight of a ball between tool and goal: with and without the escape."""
    control, stuck, params = alone(robot), Stuck(), Params(mode="qp", distance_kept=0.15)
    arm, dt = SimulatedArm(robot, lag=0.0), 0.02
    start = robot.posture(robot.home).T_base_tool
    goal = start.copy()
    goal[1, 3] -= 0.6
    ball = start[:3, 3] + [0.0, -0.3, 0.0]
    least = np.inf
    for i in range(1500):
        s = arm.state(i * dt)
        p = robot.posture(s.q)
        away = p.T_base_link[4:, :3, 3] - ball
        d = np.linalg.norm(away, axis=1)
        on = np.ascontiguousarray(p.T_base_link[4:, :3, 3])
        row = np.arange(4, len(robot.links))
        pairs = Pairs(row, d - 0.05, on, on - away, away / d[:, None], row, int(np.argmin(d)))
        g = stuck.goal(Goal(goal), p.T_base_tool, s.stamp)
        c = control.update(p, s, pairs, g, params, dt)
        stuck.see(p.T_base_tool, pairs, c, escape, s.stamp)
        arm.send(c.qd, dt)
        least = min(least, pairs.minimum)
    assert least > params.distance_kept - 0.01
    if not escape:
        assert goal_error(robot.posture(arm.state(0.0).q).T_base_tool, goal)[0] > 0.1
