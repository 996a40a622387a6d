"""Task priority with a row for every link, the obstacle's own speed, and continuity."""

import numpy as np
import pytest

from app.config import Params
from app.messages import Goal, JointState, Pairs
from app.robot.posture import Posture
from tests.alone import Alone, TaskPriorityController, alone


def pairs_of(links, points, normals, distances):
    n = np.asarray(normals, float) / np.linalg.norm(normals, axis=1)[:, None]
    d, on = np.asarray(distances, float), np.asarray(points, float)
    return Pairs(
        np.asarray(links), d, on, on - d[:, None] * n, n, np.arange(len(d)), int(np.argmin(d))
    )


FOREARM, WRIST_1, WRIST_3 = 3, 5, 7  # body links of the UR10e; 4 is the skin's cover


def two_threats(posture: Posture, first: float, second: float) -> Pairs:
    """The forearm threatened from one side, the wrist from another."""
    elbow, wrist = posture.T_base_link[WRIST_1, :3, 3], posture.T_base_link[WRIST_3, :3, 3]
    return pairs_of(
        [FOREARM, WRIST_3], [elbow, wrist], [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.3]], [first, second]
    )


def settled(control, robot, pairs, params=None, goal=None, approach=None):
    """The command after the acceleration limit has had its time."""
    posture = robot.posture(robot.home)
    state = JointState(0.0, robot.home, np.zeros(6))
    for _ in range(120):
        c = control.update(posture, state, pairs, goal, params or Params(), 0.01, approach)
    return c


def test_every_near_link_gives_way_at_once(robot):
    posture = robot.posture(robot.home)
    pairs = two_threats(posture, 0.19, 0.19)
    rates = posture.distance_rows(pairs.link, pairs.on_robot, pairs.normal)
    every, one_row = (
        Alone(robot, TaskPriorityController(robot, every_link=every, published=True))
        for every in (True, False)
    )
    both = rates @ settled(every, robot, pairs).qd
    assert both == pytest.approx([0.22, 0.22], abs=1e-3)
    one = rates @ settled(one_row, robot, pairs).qd
    assert one[0] == pytest.approx(0.22, abs=1e-3) and abs(one[1] - 0.22) > 0.05


def test_a_change_of_the_closest_link_moves_only_the_controller_that_knows_one_pair(robot):
    """The single pair of the paper is expected to jump; a row for each link does not."""
    posture = robot.posture(robot.home)
    goal = Goal(posture.T_base_tool)

    def jump(rows):
        at = [
            settled(alone(robot, rows), robot, two_threats(posture, 0.22 - e, 0.22 + e), goal=goal)
            for e in (1e-6, -1e-6)
        ]
        return np.abs(at[0].qd - at[1].qd).max()

    assert jump("multi") < 1e-3 < 0.05 < jump("wb")


def test_a_row_comes_and_goes_without_a_jump(robot):
    """A second link enters the range: from nothing to fully active, in small steps."""
    posture = robot.posture(robot.home)
    goal = Goal(posture.T_base_tool)
    control = alone(robot, "multi")
    path = np.array([
        settled(control, robot, two_threats(posture, 0.25, d), goal=goal).qd
        for d in np.linspace(0.31, 0.19, 121)
    ])  # fmt: skip
    steps, span = np.abs(np.diff(path, axis=0)), np.ptp(path, axis=0).max()
    assert span > 0.05 and steps.max() < 0.1 * span


def test_a_link_with_little_authority_fades_out_instead_of_vanishing(robot):
    """The normal turns until the joints can hardly do anything: no step in the command."""
    posture = robot.posture(robot.home)
    point = posture.T_base_link[2, :3, 3] + [0.0, 0.0, 0.1]
    control, last, largest = alone(robot, "wb"), None, 0.0
    for turn in np.linspace(0.0, np.pi / 2, 181):
        pairs = pairs_of([2], [point], [[np.cos(turn), 0.0, np.sin(turn)]], [0.2])
        qd = settled(control, robot, pairs).qd
        largest = max(largest, 0.0 if last is None else float(np.abs(qd - last).max()))
        last = qd
    assert largest < 0.02


def test_the_speed_of_the_obstacle_is_added_to_the_retreat(robot):
    posture = robot.posture(robot.home)
    pairs = two_threats(posture, 0.15, 9.0)
    rate = posture.distance_rows(pairs.link, pairs.on_robot, pairs.normal)[0]

    def retreat(w, **settings):
        params = Params(joint_speed=1.0, **settings)
        approach = np.array([w, 0.0])
        return float(rate @ settled(alone(robot, "paper"), robot, pairs, params, None, approach).qd)

    assert retreat(0.0) == pytest.approx(0.30, abs=1e-3)
    assert retreat(0.2) == pytest.approx(0.50, abs=1e-3)
    assert retreat(0.9) == pytest.approx(0.60, abs=1e-3)  # v_safe


def test_a_smaller_share_of_the_speed_is_reached_by_braking(robot):
    control, posture = alone(robot, "wb"), robot.posture(robot.home)
    away = Goal(robot.posture(robot.home + 0.5).T_base_tool)
    nothing = two_threats(posture, 9.0, 9.0)
    state = JointState(0.0, robot.home, np.zeros(6))
    fast = Params(goal_speed=1.0, goal_turning=2.0)
    for _ in range(300):
        last = control.update(posture, state, nothing, away, fast, 0.004).qd
    steps = 0
    while np.abs(last).max() > 0.0:
        qd = control.update(posture, state, nothing, away, fast, 0.004, share=0.0).qd
        assert (np.abs(qd - last) <= robot.qdd_max * 0.004 + 1e-12).all()
        last, steps = qd, steps + 1
    assert 10 < steps < 300
