"""Frames that were measured at about one time are judged together."""

import numpy as np
import pytest

from app.cell.parts import Cell
from app.perception.cloud import SkinCloud, Together
from app.perception.perception import in_one_go, of_other_sensors
from app.perception.rules import Rules
from app.perception.uncertainty import TOGETHER, known_of
from tests.fakes import frame


def test_frames_within_a_millisecond_are_judged_in_one_go_and_in_order():
    stamps = [0.0103, 0.0, 0.0004, 0.0009, 0.0012, 0.0111, 0.5]
    groups = in_one_go([frame(k, t) for k, t in enumerate(stamps)])
    assert [[f.sensor for f in g] for g in groups] == [[1, 2, 3], [4], [0, 5], [6]]


def test_no_frame_is_off_by_more_than_its_doubt_says(skin):
    rng = np.random.default_rng(0)
    for _ in range(50):
        for g in in_one_go([frame(k, t) for k, t in enumerate(rng.uniform(0.0, 0.01, 12))]):
            middle = (g[0].stamp + g[-1].stamp) / 2.0
            assert max(abs(f.stamp - middle) for f in g) <= TOGETHER / 2.0
    known = known_of(skin)
    assert known.time == pytest.approx(np.hypot(skin.doubt.time, TOGETHER / 2.0))
    assert (known.time < 1.04 * skin.doubt.time).all()


def test_nothing_is_judged_in_no_go():
    assert in_one_go([]) == []


def test_groups_are_judged_together_until_a_sensor_comes_again(robot):
    posture = robot.posture(robot.home)
    groups = [Together([frame(k, 0.0) for k in who], posture, None)
              for who in ((0, 1), (2,), (1, 3), (4,), (4,))]  # fmt: skip
    parted = of_other_sensors(groups)
    assert parted == [groups[:2], groups[2:4], groups[4:]]
    assert of_other_sensors([]) == []


def test_judged_together_each_group_is_what_it_would_be_alone(robot, skin):
    rng, rules = np.random.default_rng(3), Rules()
    together, alone = SkinCloud(robot, skin, Cell()), SkinCloud(robot, skin, Cell())
    for i in range(6):
        order = np.array_split(rng.permutation(skin.count)[:12], 4)
        groups = []
        for who in order:
            depth = rng.uniform(0.05, 1.0)
            frames = [frame(int(k), 0.1 * i, rng.normal(depth, 0.02, 64)) for k in who]
            posture = robot.posture(robot.home + rng.uniform(-0.3, 0.3, robot.n))
            groups.append(Together(frames, posture, rng.uniform(-0.5, 0.5, robot.n)))
        for group in together.foresee(groups, rules):
            together.take(group, rules)
        for group in groups:
            alone.add_frames(group.frames, group.posture, rules, group.qd)
        a, b = together.view(0.1 * i), alone.view(0.1 * i)
        for name in ("points", "verdict", "link", "gap", "eps", "stamp"):
            assert np.array_equal(getattr(a, name), getattr(b, name), equal_nan=True), name
    assert len(np.unique(a.verdict)) > 2
