"""Unseen space: what is lost from sight, what it costs, and when the arm stops for it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from app.actions import SetGoal
from app.config import Params
from app.control.clearance import Clearance
from app.control.controller import Situation
from app.control.unseen import Unseen, UnseenLimit
from app.messages import Command, JointState, Mode, Pairs, SensorHealth
from app.perception.blindness import BREADTH, cones_of
from app.perception.health import SkinHealth
from app.perception.unable import Unable
from app.robot.skin import build_skin
from tests.fakes import frame
from tests.test_brain import Bench

ROUGH = 0.03  # [m] zones are taken two by two: their common ray is off by half of their width


def dense_rays(skin, zones):
    """Points every 5 mm on the rays of these zones, up to a metre before the lens."""
    start = skin.origin[skin.sensor_of[zones]][:, None]
    ray = skin.reach[zones] / np.linalg.norm(skin.reach[zones], axis=1, keepdims=True)
    return (start + np.arange(0.0, 1.0, 0.005)[:, None] * ray[:, None]).reshape(-1, 3)


@pytest.mark.parametrize("seed", range(4))
def test_a_point_is_unseen_where_no_zone_that_tells_has_a_ray_near_it(skin, seed):
    rng = np.random.default_rng(seed)
    cones = cones_of(skin)
    lost = np.isin(skin.sensor_of, rng.choice(skin.count, [2, 9, 14, 22][seed], replace=False))
    lost |= np.isin(skin.sensor_of, rng.choice(skin.count, 4)) & (np.arange(skin.slots) % 64 < 32)
    tell = cones.blocks(~lost)
    unseen = cones.unseen(~tell, tell)
    assert len(unseen.point) > 0
    near = cKDTree(dense_rays(skin, np.flatnonzero(~lost)))
    assert near.query(unseen.point)[0].min() > BREADTH - ROUGH
    of_lost = cKDTree(dense_rays(skin, np.flatnonzero(lost)))
    assert of_lost.query(unseen.point)[0].max() < ROUGH  # what never was seen is not counted
    every = cones.unseen(~tell, np.zeros_like(tell))
    known = {tuple(p) for p in unseen.point.tolist()}
    seen = np.array([p for p in every.point.tolist() if tuple(p) not in known])
    assert near.query(seen)[0].max() < BREADTH + ROUGH


def test_with_all_sensors_nothing_is_unseen_and_with_one_lost_nothing_near(skin):
    cones = cones_of(skin)
    every = np.ones(len(cones.owner), dtype=bool)
    assert len(cones.unseen(~every, every).point) == 0
    for k in range(skin.count):
        lost = cones.owner == k
        unseen = cones.unseen(lost, ~lost)
        assert set(unseen.sensor.tolist()) <= {k}
        away = np.linalg.norm(unseen.point - skin.origin[k], axis=1)
        assert away.min(initial=1.0) > 0.18  # an arm at 0.6 m/s stops within that


def situation(robot, q, dt=0.008, applied=None):
    none = np.empty(0, dtype=np.int64)
    nothing = Pairs(none, np.empty(0), *[np.empty((0, 3))] * 3, none, closest=-1)
    still = np.zeros(robot.n) if applied is None else applied
    return Situation(
        robot.posture(q), JointState(0.0, q, still), nothing, None, Params(), dt, 1.0, still
    )


def gaps(robot, pieces, posture, points):
    """Distances (n, Q) [m] from points to capsules, by 2000 points on each axis."""
    out = np.empty((len(points), len(pieces.radius)))
    for i, (ends, radius, link) in enumerate(
        zip(pieces.ends, pieces.radius, pieces.link, strict=True)
    ):
        T = posture.T_base_link[link]
        axis = ends[0] + np.linspace(0.0, 1.0, 2000)[:, None] * (ends[1] - ends[0])
        out[:, i] = cKDTree(axis @ T[:3, :3].T + T[:3, 3]).query(points)[0] - radius
    return out


def test_the_body_is_slowed_to_what_it_can_stop_from_by_finite_differences(robot, skin):
    rng, cones = np.random.default_rng(5), cones_of(skin)
    pieces, slowed = Clearance(robot).pieces, 0
    limit = UnseenLimit(robot, pieces)
    for _ in range(12):
        tell = cones.blocks(np.isin(skin.sensor_of, rng.choice(30, 18)))
        unseen = Unseen(*cones.unseen(~tell, tell))
        q, qd = robot.home + rng.uniform(-0.5, 0.5, 6), rng.uniform(-0.4, 0.4, 6)
        now = situation(robot, q, applied=qd)
        T = now.posture.T_base_link[unseen.link]
        points = np.einsum("nij,nj->ni", T[:, :3, :3], unseen.point) + T[:, :3, 3]
        before = gaps(robot, pieces, now.posture, points)
        after = gaps(robot, pieces, robot.posture(q + 1e-4 * qd), points)
        towards = (before - after) / 1e-4
        own = robot.welded[unseen.link][:, pieces.link]
        behind = ((before < 0.0) & ~own).any(axis=1)  # another link is in the sensor's way
        a, T_r = now.params.braking, now.params.reaction_time
        allowed = np.sqrt((a * T_r) ** 2 + 2.0 * a * np.maximum(before, 0.0)) - a * T_r
        share = np.where(towards > 1e-6, allowed / np.maximum(towards, 1e-6), 1.0)[~behind]
        expected = min(share.min(initial=1.0), 1.0)
        command = limit.slowed(Command(qd=qd), now, unseen)
        assert command.unseen == pytest.approx(expected, abs=0.02)
        assert (np.abs(command.qd - qd) <= robot.qdd_max * now.dt + 1e-9).all()
        slowed += command.unseen < 1.0
    assert slowed > 4


def facing(skin, snapshot, direction):
    """The sensors, those first that look most in a direction of the base frame."""
    T = snapshot.T_base_link[skin.link]
    axis = np.einsum("kij,kj->ki", T[:, :3, :3], skin.axis)
    return np.argsort(-(axis @ direction), kind="stable")


def pushed(bench, shift):
    T = np.array(bench.engine.step().T_base_tool)
    T[:3, 3] += shift
    return SetGoal(T)


def test_one_silent_sensor_is_named_and_costs_nothing(robot, skin):
    fastest = []
    for dead in ((), (12,)):
        bench = Bench(robot, skin, rate=125.0)
        bench.run(0.3)
        bench.eye.muted.update(dead)
        bench.run(0.7)
        s = bench.run(1.0, pushed(bench, [0.0, -0.6, 0.0]))
        assert s.status.mode is Mode.RUNNING
        fastest.append(np.abs(s.joints.qd).max())
    assert s.advice == "cannot see with ring2-03 (silent)" and s.unable[12] == Unable.SILENT
    assert s.blind == pytest.approx(1 / 30) and fastest[1] == pytest.approx(fastest[0], rel=1e-3)


def test_the_arm_does_not_go_where_the_sensors_ahead_cannot_see_but_goes_elsewhere(robot, skin):
    side = np.array([0.0, -1.0, 0.0])
    moved = []
    for way in (side, -side):
        bench = Bench(robot, skin, rate=125.0)
        ahead = facing(skin, bench.run(0.3), side)[:13]
        bench.eye.muted.update(ahead.tolist())
        before = bench.run(0.9)
        s = bench.run(1.5, pushed(bench, 0.4 * way))
        moved.append(np.linalg.norm(s.T_base_tool[:3, 3] - before.T_base_tool[:3, 3]))
        assert s.status.mode is Mode.RUNNING and "cannot see with" in s.advice
    assert "and 10 more" in s.advice
    assert moved[0] < 0.01 < 0.2 < moved[1]


def test_half_of_the_skin_lost_stops_the_arm_by_name(robot, skin):
    bench = Bench(robot, skin, rate=125.0)
    bench.run(0.3)
    poll = bench.eye.poll

    def sunny(now, posture):
        return [
            frame(f.sensor, f.stamp, f.distance, 13 if f.sensor < 15 else f.status, f.targets)
            for f in poll(now, posture)
        ]

    bench.eye.poll = sunny
    s = bench.run(1.0)
    assert s.status.mode is Mode.STOPPED and s.blind == 0.5
    assert s.status.reason.startswith(
        "15 of 30 sensors cannot see: ring1-01 (bad status), ring1-02 (bad status), "
    )


def test_a_zone_here_and_there_without_use_is_no_blindness(robot, skin):
    rng = np.random.default_rng(0)
    bench = Bench(robot, skin, rate=125.0)
    bad = rng.permuted(np.tile(np.arange(64) < 12, (30, 1)), axis=1)
    poll = bench.eye.poll
    bench.eye.poll = lambda now, posture: [
        frame(f.sensor, f.stamp, f.distance, np.where(bad[f.sensor], 4, f.status), f.targets)
        for f in poll(now, posture)
    ]
    s = bench.run(1.0)
    assert s.status.mode is Mode.RUNNING and s.advice == "" and not s.unable.any()


@pytest.mark.parametrize(("moves", "unable"), [(0.0, Unable.SEES), (0.01, Unable.FROZEN)])
def test_values_that_stay_are_frozen_only_if_the_sensor_was_moved(robot, skin, moves, unable):
    one = build_skin("one", skin.sensors[:1], robot)
    health = SkinHealth(one, robot.supports[one.link])
    health.connect(np.array([True]))
    for i in range(12):
        health.update([frame(0, i / 15, 0.8)], i / 15, robot.home + moves * i)
    assert health.unable(11 / 15, 0.6, 0.0)[0] == unable
    assert SensorHealth(health.states(11 / 15)[0]) is SensorHealth.FROZEN
    health.update([frame(0, 12 / 15, 0.9)], 12 / 15, robot.home)
    assert health.unable(12 / 15, 0.6, 0.0)[0] == Unable.SEES


def test_the_page_shows_the_cones_that_nobody_watches_and_says_why(robot, skin):
    from app.timing import ManualClock
    from app.ui.page import Page

    bench = Bench(robot, skin, rate=125.0)
    before = bench.run(0.3)
    bench.eye.muted.update((0, 12))
    after = bench.run(0.9)
    page = Page(bench.engine, port=0, clock=ManualClock(0.0))
    try:
        page.cones.update(before)
        page.health.update(before)
        assert page.cones.cones == [] and "Cannot see" not in page.health.table.content
        page.cones.update(after)
        (cones,) = page.cones.cones
        placed = np.array([s.T_link_sensor[:3, 3] for s in (skin.sensors[0], skin.sensors[12])])
        assert np.allclose(cones.batched_positions, placed, atol=1e-6)
        page.cones.update(after)
        assert page.cones.cones == [cones]  # not sent again while nothing changes
        page.health.update(after)
        assert "ring1-01, ring2-03" in page.health.table.content
        assert "silent" in page.health.table.content
    finally:
        page.stop()


def test_a_sensor_that_never_speaks_is_not_waited_for_as_long_as_one_that_has(robot, skin):
    one = build_skin("one", skin.sensors[:1], robot)
    health = SkinHealth(one)
    health.connect(np.array([True]))
    unable = [health.unable(t, 0.6, 0.0)[0] for t in (0.25, 0.35)]
    assert unable == [Unable.SEES, Unable.SILENT]
    health.update([frame(0, 0.4, 0.8)], 0.4)
    unable = [health.unable(t, 0.6, 0.0)[0] for t in (0.95, 1.05)]
    assert unable == [Unable.SEES, Unable.SILENT]
