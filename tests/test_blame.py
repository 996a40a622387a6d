"""Whose fault a touch is: the judge's questions, on cases that a person can answer."""

import numpy as np
import pytest

from app.judge.blame import AHEAD, Blame, Cause, Judgement, Moment, cause
from app.judge.contact import Contacts, speed_towards
from app.judge.free_direction import free_direction, motion_between, point_velocity, speed_row
from app.judge.truth import TrueDistance, TruePair
from app.poses import transform
from app.world.motion import Still
from app.world.shapes import make_shape
from app.world.world import Body, World

TOOL = 6  # a link that six joints move
STILL, UP = np.zeros((4, 4)), np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def truth(robot):
    return TrueDistance([(b.vertices, b.faces) for b in robot.bodies])


def ball(position, name="ball"):
    shape = make_shape({"kind": "sphere", "radius_m": 0.1}, None, name)
    return Body(name, shape, (0, 0, 0), Still(transform(np.array(position, float), np.zeros(3))))


def tool_pairs(robot, distances, normals):
    """Pairs at the tool, each with a body of its own along a normal."""
    on = robot.posture(robot.home).T_base_tool[:3, 3]
    return [
        TruePair(TOOL, str(i), d, on, on - d * np.array(n), np.array(n, float))
        for i, (d, n) in enumerate(zip(distances, normals, strict=True))
    ]


def test_a_free_direction_is_one_that_leaves_every_near_link_room(robot):
    def free(distances, normals, coming):
        motions = {}
        for i, (n, speed) in enumerate(zip(normals, coming, strict=True)):
            motions[str(i)] = STILL.copy()
            motions[str(i)][:3, 3] = speed * np.array(n)
        pairs = tool_pairs(robot, distances, normals)
        return free_direction(robot, robot.home, pairs, motions, 0.5)

    x, y, back = [1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0]
    assert free([], [], [])
    assert free([0.05], [x], [0.2]) and free([0.05, 0.05], [x, y], [0.1, 0.1])
    assert not free([0.05, 0.05], [x, back], [0.1, 0.0])  # a wall behind
    assert free([0.05, 0.05], [x, back], [0.1, -0.1])  # which leaves as fast
    assert free([0.05, 0.40], [x, back], [0.1, 0.0])  # which is far enough
    assert not free([0.05], [x], [5.0])  # too fast for any joint


def test_the_rows_of_the_judge_are_those_of_the_kinematics(robot):
    rng = np.random.default_rng(2)
    q = robot.home + rng.uniform(-0.5, 0.5, robot.n)
    posture = robot.posture(q)
    for link in np.flatnonzero(robot.supports.any(axis=1)):
        on, n = rng.uniform(-0.5, 0.5, 3), rng.normal(size=3)
        n /= np.linalg.norm(n)
        row = speed_row(robot, q, TruePair(int(link), "", 0.1, on, on - 0.1 * n, n))
        expected = posture.distance_rows(np.array([link]), on[None], n[None])[0]
        assert row == pytest.approx(expected, abs=1e-7)


def test_what_carries_a_body_on_gives_the_speed_of_its_points():
    before = transform(np.array([0.3, 0.1, 0.2]), np.array([0.1, 0.2, 0.3]))
    after = transform(np.array([0.31, 0.1, 0.2]), np.array([0.1, 0.2, 0.31]))
    local = np.array([0.1, -0.2, 0.05, 1.0])
    moved = (after @ local - before @ local)[:3] / 0.02
    found = point_velocity(motion_between(before, after, 0.02), (before @ local)[:3])
    assert found == pytest.approx(moved)


def test_near_pairs_are_where_link_and_body_are_closest(robot, truth):
    T = robot.posture(robot.home).T_base_link
    tool = robot.posture(robot.home).T_base_tool[:3, 3]
    world = World([ball(tool - 0.15 * UP, "near"), ball(tool + 2.0 * UP, "far")])
    pairs = truth.near_pairs(T, world.shapes(), world.poses(), 0.5)
    assert {p.body for p in pairs} == {"near"} and len(pairs) > 1
    for p in pairs:
        assert p.distance == pytest.approx(truth.measure(T, world)[p.link], abs=1e-6)
        assert p.on_link - p.on_body == pytest.approx(p.distance * p.normal, abs=1e-6)


def moments(robot, world, seen):
    """Still ones, 0.1 s apart, with the same link's perceived distances."""
    T, links = robot.posture(robot.home).T_base_link, len(robot.links)
    every = []
    for i, d in enumerate(seen):
        believed = np.full(links, np.inf)
        believed[TOOL] = d
        stamp = i * AHEAD / (len(seen) - 1)
        every.append(Moment(stamp, robot.home, T, world.poses(), believed))
    return every


def test_a_touch_that_was_seen_and_could_be_avoided_is_to_blame():
    assert cause(seen=True, free=True) is Cause.AVOIDABLE
    assert cause(seen=True, free=False) is Cause.NO_WAY
    assert cause(seen=False, free=True) is cause(seen=False, free=False) is Cause.NOT_SEEN


def test_what_was_known_at_first_and_then_lost_is_avoidable_by_the_first_moment_alone(robot, truth):
    tool = robot.posture(robot.home).T_base_tool[:3, 3]
    world = World([ball(tool - 0.3 * UP)])
    d = truth.measure(robot.posture(robot.home).T_base_link, world)[TOOL]
    judge = Judgement(robot, truth, world.shapes(), 0.5)
    known, lost = moments(robot, world, [d + 0.09] * 3), moments(robot, world, [d, np.inf, d])
    late = moments(robot, world, [np.inf, d, d])
    assert judge.blame(known, TOOL) == Blame(Cause.AVOIDABLE, Cause.AVOIDABLE)
    assert judge.blame(lost, TOOL) == Blame(Cause.AVOIDABLE, Cause.NOT_SEEN)
    assert judge.blame(late, TOOL) == Blame(Cause.NOT_SEEN, Cause.NOT_SEEN)


def test_a_phantom_is_what_is_believed_nearer_than_anything_is(robot, truth):
    tool = robot.posture(robot.home).T_base_tool[:3, 3]
    world = World([ball(tool - 0.3 * UP)])
    d = truth.measure(robot.posture(robot.home).T_base_link, world)[TOOL]
    judge = Judgement(robot, truth, world.shapes(), 0.5)
    assert judge.phantom(moments(robot, world, [d, np.inf])) == pytest.approx(0.0, abs=1e-6)
    assert judge.phantom(moments(robot, world, [d, d - 0.2])) == pytest.approx(0.2, abs=1e-6)


def test_a_link_that_no_joint_moves_away_has_no_way_out_however_far_the_body_was(robot, truth):
    shoulder, T = robot.link_index("shoulder_link"), robot.posture(robot.home).T_base_link
    for link, verdict in ((shoulder, Cause.NO_WAY), (TOOL, Cause.AVOIDABLE)):
        at, past = T[link, :3, 3], []
        side = np.array([1.0, 0.0, 0.0]) if link == shoulder else UP
        for i in range(6):  # it comes at 0.5 m/s and is more than 0.2 m away at first
            world = World([ball(at + (0.45 - 0.05 * i) * side)])
            d = truth.measure(T, world)
            past.append(Moment(i * AHEAD / 5, robot.home, T, world.poses(), d))
        assert past[0].seen[link] > 0.2
        assert Judgement(robot, truth, world.shapes(), 0.5).blame(past, link).first is verdict


def test_a_touch_is_the_arms_own_where_its_point_moves_into_the_body(robot, truth):
    q = robot.home
    T, tool = robot.posture(q).T_base_link, robot.posture(q).T_base_tool[:3, 3]
    world = World([ball(tool)])
    deepest = min(truth.near_pairs(T, world.shapes(), world.poses(), 0.0), key=lambda p: p.distance)
    row = speed_row(robot, q, deepest)
    into = -0.1 * row / (row @ row)  # 0.1 m/s towards the ball
    assert speed_towards(robot, q, into, deepest) == pytest.approx(0.1)
    stands, runs, leaves = (Contacts(robot, truth, world.shapes()) for _ in range(3))
    for contacts, qd in ((stands, 0.0 * into), (runs, into), (leaves, -into)):
        for now in (0.0, 0.02):
            contacts.update(now, q, qd, T, world.poses())
        assert {c.at for c in contacts.found} == {0.0}  # one that lasts is one
    link = deepest.link
    assert [c.moved_into for c in runs.found if c.link == link] == [True]
    assert not any(c.moved_into for c in stands.found)
    assert [c.moved_into for c in leaves.found if c.link == link] == [False]
