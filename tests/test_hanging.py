"""Hoses that nobody has modelled, and what only looks like one."""

from dataclasses import replace

import numpy as np
import pytest

from app.cell.parts import Cell
from app.messages import Verdict
from app.perception.cloud import SkinCloud
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.perception.things import find_in_holes
from app.sensing.budget import IDEAL
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.world import World
from tests.fakes import frame

P = Rules(doubts_windows=False)  # which doubts hoses as well, while the arm stands


def kept(robot, skin, eye, q, rules):
    """Slots of zones that are kept in the second frame of all sensors, at q."""
    cloud, posture = SkinCloud(robot, skin, Cell()), robot.posture(q)
    for i in range(2):
        frames = eye.poll(i * skin.sensors[0].type.period + 0.0667, posture)
        cloud.add_frames([f for f in frames], posture, rules)
    return np.flatnonzero(cloud.newest().verdict == Verdict.KEPT)


def folded(robot, seed):
    q = robot.home + np.random.default_rng(seed).uniform(-0.3, 0.3, robot.n)
    q[2] = 2.5
    return q


def test_a_hose_on_a_link_is_part_of_the_arm(robot, skin):
    passed = hung = 0
    for seed in range(4):
        eye = SimulatedSkin(
            robot, skin, World(()), seed, ErrorModel(ideal=True), latency=0.0,
            budget=replace(IDEAL, body=1.0),
        )  # fmt: skip
        q = folded(robot, seed)
        passed += len(kept(robot, skin, eye, q, P._replace(doubts_hoses=False)))
        hung += len(kept(robot, skin, eye, q, P))
    assert passed > 20
    assert hung <= 0.02 * passed


def test_a_thing_near_a_link_that_reaches_farther_is_none_of_the_arm(robot, skin):
    q = folded(robot, 0)
    upper = robot.posture(q).T_base_link[robot.link_index("upper_arm_link")]
    world = World(())
    beside = upper[:3, 3] + upper[:3, 0] * -0.3 + upper[:3, 2] * 0.3
    world.add("", {"kind": "box", "size_m": [0.3, 0.3, 0.1]}, tuple(beside))
    eyes = [SimulatedSkin(robot, skin, world, 0, ErrorModel(ideal=True), latency=0.0) for _ in "ab"]
    without = kept(robot, skin, eyes[0], q, P._replace(doubts_hoses=False))
    assert len(without) > 50
    assert len(kept(robot, skin, eyes[1], q, P)) > 0.95 * len(without)


@pytest.mark.parametrize(("times", "first"), [(1.3, Verdict.GHOST), (3.0, Verdict.KEPT)])
def test_what_is_hardly_before_the_body_is_asked_twice(robot, skin, times, first):
    """A lone zone just before the upper arm: as near as noise might carry it, and nearer."""
    q = robot.home.copy()
    q[2] = 2.6
    posture, far = robot.posture(q), np.full(skin.slots, 9.0)
    everyone, link = np.arange(skin.count), robot.link_index("upper_arm_link")
    one = SelfFilter(robot, skin).judge(everyone, far, posture, P._replace(footprint=False))
    slot = int(np.argmax(np.where(one.link == link, one.gap, -np.inf)))
    k, zone, body = slot // 64, slot % 64, 9.0 + one.gap[slot]
    front = SelfFilter(robot, skin).judge(everyone, np.full(skin.slots, body), posture, P)
    eps = front.eps[slot]
    near = SelfFilter(robot, skin).judge(
        everyone, np.full(skin.slots, body - 0.1), posture, P
    ).gap[slot] - 0.1  # fmt: skip
    d, status = np.full(64, 1.0), np.full(64, 4)
    d[zone], status[zone] = body + near - times * eps, 5
    cloud = SkinCloud(robot, skin, Cell())
    rules = P._replace(doubts_hoses=False)
    seen = []
    for i in range(2):
        cloud.add_frames([frame(k, i / 15, d, status=status)], posture, rules)
        seen.append(Verdict(cloud.newest().verdict[slot]))
    assert seen == [first, Verdict.KEPT]


@pytest.mark.parametrize(("hole", "beside", "found"), [(0.6, 0.3, 2), (0.6, 0.9, 0), (0.3, 0.6, 0)])
def test_what_is_seen_through_a_hole_in_something_nearer_is_part_of_that(hole, beside, found):
    z, kept = np.full(64, beside), np.ones(64, dtype=bool)
    z[[27, 28]] = hole
    known = np.abs(z - beside) < 1e-9
    find_in_holes(z, kept, np.array([8, 8]), known)
    assert known[[27, 28]].sum() == found


def test_what_has_the_arm_beside_it_is_seen_through_no_hole():
    z, kept = np.full(64, 0.3), np.ones(64, dtype=bool)
    z[[27, 28]], kept[18:22] = 0.6, False  # the link under the hose
    known = kept & (z < 0.5)
    find_in_holes(z, kept, np.array([8, 8]), known)
    assert not known[[27, 28]].any()
    alone, sees = np.zeros(1, dtype=bool), np.ones(1, dtype=bool)
    find_in_holes(np.array([0.5]), sees, np.array([1, 1]), alone)
    assert not alone.any()  # one zone has nothing round it
