"""What touches a lens is the nearest thing there is, until it is seen to leave."""

import numpy as np
import pytest

from app.actions import AddObstacle
from app.cell.parts import Cell
from app.messages import Mode, Verdict
from app.perception.cloud import SkinCloud
from app.perception.rules import PUBLISHED, Rules
from app.perception.unable import Unable
from tests.fakes import frame
from tests.test_brain import Bench

P = Rules()
SENSOR = 12
AT = slice(64 * SENSOR, 64 * SENSOR + 64)


@pytest.fixture
def cloud(robot, skin):
    return SkinCloud(robot, skin, Cell())


def say(cloud, posture, i, distance, rules=P, **what):
    cloud.add_frames([frame(SENSOR, i / 15, distance, **what)], posture, rules)
    return cloud.view(i / 15)


def test_what_is_nearer_than_can_be_measured_is_held_at_the_lens_until_it_is_seen_to_leave(
    robot, skin, cloud
):
    posture = robot.posture(robot.home)
    assert say(cloud, posture, 0, 0.05).verdict[AT].max() == Verdict.KEPT
    T = posture.T_base_link[skin.link[SENSOR]]
    lens = T[:3, :3] @ skin.origin[SENSOR] + T[:3, 3]
    for i, what in enumerate(
        [{"distance": 0.008}]
        + [{"distance": 0.3, "status": 13}] * 5
        + [{"distance": 0.7, "status": 255, "targets": 0}] * 5
        + [{"distance": 0.012}] * 5,
        start=1,
    ):
        seen = say(cloud, posture, i, **what)
        assert (seen.verdict[AT] == Verdict.CONTACT).all()
        assert np.linalg.norm(seen.points[AT] - lens, axis=1).max() < 0.02
    silent = cloud.view(i / 15 + 60.0)  # nobody has seen it leave
    assert (silent.verdict[AT] == Verdict.CONTACT).all()
    left = say(cloud, posture, i + 1, 0.05)
    assert (left.verdict[AT] == Verdict.KEPT).all() and not cloud.unable.any()


def test_a_loose_return_of_a_few_zones_is_no_contact(robot, cloud):
    near = np.where(np.arange(64) < 10, 0.008, 1.0)
    seen = say(cloud, robot.posture(robot.home), 0, near)
    assert (seen.verdict[AT][:10] == Verdict.OUT_OF_RANGE).all()
    assert Verdict.CONTACT not in seen.verdict


def test_the_paper_feels_no_contact(robot, cloud):
    seen = say(cloud, robot.posture(robot.home), 0, 0.008, PUBLISHED)
    assert (seen.verdict[AT] == Verdict.OUT_OF_RANGE).all()


def test_what_rides_along_at_the_lens_covers_it(robot, cloud):
    q = robot.home.copy()
    for i in range(10):
        seen = say(cloud, robot.posture(q), i, 0.008)
        q[0] += 0.1
    assert cloud.unable[SENSOR] == Unable.COVERED and Verdict.CONTACT not in seen.verdict
    say(cloud, robot.posture(q), 11, 0.4)
    assert cloud.unable[SENSOR] == Unable.SEES


def test_a_lens_that_sees_nothing_since_it_was_touched_cannot_tell(robot, cloud):
    posture = robot.posture(robot.home)
    say(cloud, posture, 0, 0.008)
    for i in range(1, 20):
        seen = say(cloud, posture, i, 0.5, status=255, targets=0)
    assert cloud.unable[SENSOR] == Unable.DARK and Verdict.CONTACT not in seen.verdict


def test_a_surface_that_vanishes_from_all_zones_at_once_has_not_gone(robot, cloud):
    posture = robot.posture(robot.home)
    for distance, unable in ((0.5, Unable.DARK), (0.15, Unable.SEES), (1.5, Unable.SEES)):
        cloud.reset()
        say(cloud, posture, 0, distance)
        say(cloud, posture, 1, 0.7, status=255, targets=0)
        assert cloud.unable[SENSOR] == unable
    say(cloud, posture, 2, 0.6)
    assert cloud.unable[SENSOR] == Unable.SEES


def test_a_sensor_that_must_see_the_arm_and_does_not_is_dark(robot, skin):
    """Folded, the forearm looks at the upper arm; what is black before a window hides that."""
    q = robot.home.copy()
    q[2] = 2.6
    posture = robot.posture(q)
    for empty in (False, True):
        cloud = SkinCloud(robot, skin, Cell())
        everyone = [frame(k, 0.0, 0.5, status=255, targets=0) for k in range(skin.count)]
        cloud.add_frames(everyone, posture, P)
        body = cloud.newest().gap + 0.5
        link = cloud.newest().link
        must = (link >= 0) & (body > 0.02) & (body < 0.3)
        looks = np.flatnonzero(np.bincount(skin.sensor_of[must], minlength=skin.count) >= 24)
        assert len(looks) > 0
        for i in range(1, 8):
            for k in looks:
                seen = np.where(must & (not empty), body, 0.5)[skin.zones(k)]
                target = (must & (not empty))[skin.zones(k)].astype(np.uint8)
                status = np.where(target, 5, 255)
                cloud.add_frames([frame(k, i / 15, seen, status, target)], posture, P)
        expected = Unable.DARK if empty else Unable.SEES
        assert (cloud.unable[looks] == expected).all()


@pytest.mark.parametrize("falls_silent", [False, True])
def test_a_hand_on_a_window_is_given_way_to_and_not_gone_back_into(robot, skin, falls_silent):
    bench = Bench(robot, skin, rate=125.0)
    s = bench.run(0.3)
    T = s.T_base_link[skin.link[SENSOR]]
    lens = T[:3, :3] @ skin.origin[SENSOR] + T[:3, 3]
    axis = T[:3, :3] @ skin.axis[SENSOR]
    hand = tuple(lens + (0.05 + 0.008) * axis)
    s = bench.run(0.2, AddObstacle("hand", {"kind": "sphere", "radius_m": 0.05}, hand))
    assert (s.cloud.verdict[AT] == Verdict.CONTACT).all() and s.body.minimum < 0.02
    assert s.command.activation > 0.0
    if falls_silent:
        bench.eye.muted.add(SENSOR)
    gaps = []
    for _ in range(20):
        s = bench.run(0.1)
        gaps.append(np.linalg.norm(lens_of(s, skin) - hand) - 0.05)
        assert gaps[-1] > 0.0 and s.status.mode is Mode.RUNNING
    assert min(gaps[10:]) > 0.05  # it has gone away and stays away, though its goal is there


def lens_of(s, skin):
    T = s.T_base_link[skin.link[SENSOR]]
    return T[:3, :3] @ skin.origin[SENSOR] + T[:3, 3]
