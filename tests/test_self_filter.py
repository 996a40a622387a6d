"""Algorithm 1: the verdict of every zone, against the simulator's truth and a float64 judge."""

from dataclasses import replace
from itertools import pairwise

import msgspec
import numpy as np
import pytest

from app.cell.parts import Box, Cell
from app.messages import SensorHealth, Verdict
from app.perception.casting import aim
from app.perception.cloud import SkinCloud
from app.perception.health import SkinHealth
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.perception.static_filter import StaticFilter
from app.robot.skin import build_skin
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.world import World
from tests.fakes import frame, retyped

P = Rules()
NO_CELL = Cell()


def cluttered_world():
    world = World(())
    rng = np.random.default_rng(8)
    for _ in range(14):
        world.add("", {"kind": "sphere", "radius_m": 0.12}, tuple(rng.uniform(-1.0, 1.0, 3)))
    return world


def postures(robot, count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield robot.posture(rng.uniform(-2.6, 2.6, robot.n))


def test_verdicts_agree_with_the_true_label_away_from_boundaries(robot, skin):
    eye = SimulatedSkin(robot, skin, cluttered_world(), 0, ErrorModel(ideal=True))
    judge = SelfFilter(robot, skin)
    right = total = own = 0
    for posture in postures(robot, 80, 9):
        readings = [eye.read(k, posture) for k in range(skin.count)]
        depth = np.array([r.depth for r in readings])
        label = np.array([r.label for r in readings])
        pure = np.array([r.pure for r in readings])
        finite = depth > 0.02  # nearer, the range check has the word
        finite &= np.isfinite(depth)
        d = np.where(finite, depth, 1.0)
        judged = shaped(judge.judge(np.arange(skin.count), d.ravel(), posture, P))
        # farther than 2 eps from a boundary between labels: by depth to the body in the ray's
        # way, and sideways, the zone and its neighbours see one label only
        near = np.abs(judged.gap) < 2 * judged.eps
        grid = np.where(finite, label, -2).reshape(-1, 8, 8)
        calm = pure.reshape(-1, 8, 8).copy()
        padded = np.pad(grid, ((0, 0), (1, 1), (1, 1)), mode="edge")
        for i in range(3):
            for j in range(3):
                calm &= padded[:, i : i + 8, j : j + 8] == grid
        is_self = finite & (label >= 0) & calm.reshape(-1, 64)
        is_world = finite & (label == -1) & calm.reshape(-1, 64) & ~near
        right += (judged.verdict[is_self] == Verdict.SELF).sum()
        right += (judged.verdict[is_world] == Verdict.KEPT).sum()
        total += is_self.sum() + is_world.sum()
        own += is_self.sum()
    assert own > 2000 and total > 10000
    assert right / total >= 0.995


def shaped(judged):
    """A judgement of 8x8 sensors by sensor and zone."""
    parts = {
        name: part.reshape(-1, 64) for name, part in judged._asdict().items() if name != "aims"
    }
    return judged._replace(**parts)


def slow_hits(robot, posture, origin, direction):
    """Nearest hit of one ray with every link but the sensor's, Moeller-Trumbore in float64."""
    best = np.inf
    for link, body in enumerate(robot.bodies):
        T = posture.T_base_link[link]
        a, b, c = (body.vertices[body.faces[:, k]] @ T[:3, :3].T + T[:3, 3] for k in range(3))
        h = np.cross(direction, c - a)
        det = np.einsum("ij,ij->i", b - a, h)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = origin - a
            u = np.einsum("ij,ij->i", s, h) / det
            q = np.cross(s, b - a)
            v = q @ direction / det
            t = np.einsum("ij,ij->i", c - a, q) / det
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0.015)
        if hit.any():
            best = min(best, t[hit].min())
    return best


def test_the_gap_equals_a_float64_ray_cast(robot, skin):
    rng = np.random.default_rng(10)
    judge = SelfFilter(robot, skin)
    one_ray = P._replace(footprint=False)
    compared = 0
    for posture in postures(robot, 60, 11):
        depth = rng.uniform(0.1, 1.5, (skin.count, 64))
        gap = shaped(judge.judge(np.arange(skin.count), depth.ravel(), posture, one_ray)).gap
        # half of the zones look at the body, so that a hit is compared as often as a miss
        facing = np.argwhere(np.isfinite(gap))
        anyone = rng.integers([0, 0], [skin.count, 64], (10, 2))
        for k, z in [*rng.choice(facing, 10), *anyone] if len(facing) else anyone:
            T = posture.T_base_link[skin.link[k]]
            reach = T[:3, :3] @ skin.reach[64 * k + z]
            length = np.linalg.norm(reach)
            hit = slow_hits(robot, posture, T[:3, :3] @ skin.origin[k] + T[:3, 3], reach / length)
            if np.isfinite(hit) and np.isfinite(gap[k, z]):
                assert gap[k, z] == pytest.approx(hit / length - depth[k, z], abs=1e-4)
                compared += 1
            else:
                assert np.isfinite(hit) == np.isfinite(gap[k, z])
    assert compared > 200


@pytest.fixture
def facing(robot, skin):
    """A zone that looks at the upper arm: (posture, sensor, zone, depth of the body there)."""
    q = robot.home.copy()
    q[2] = 2.6
    posture = robot.posture(q)
    everywhere = np.full((skin.count, 64), 0.3)
    judged = shaped(
        SelfFilter(robot, skin).judge(
            np.arange(skin.count), everywhere.ravel(), posture, P._replace(footprint=False)
        )
    )
    link, gap = judged.link, judged.gap
    upper = robot.link_index("upper_arm_link")
    reach = np.where((link == upper) & np.isfinite(gap), gap, -np.inf)
    k, z = np.unravel_index(np.argmax(reach), reach.shape)
    return posture, int(k), int(z), float(gap[k, z] + 0.3)


def verdict_at(robot, skin, facing, offset, rules=P):
    posture, k, z, depth = facing
    cloud = SkinCloud(robot, skin, Cell())
    cloud.add_frames([frame(k, 0.0, depth + offset)], posture, rules)
    view = cloud.view(0.0)
    return Verdict(view.verdict[64 * k + z]), view, 64 * k + z


def test_a_return_from_the_body_is_self_with_link_gap_and_threshold(robot, skin, facing):
    verdict, view, slot = verdict_at(robot, skin, facing, 0.0)
    assert verdict is Verdict.SELF
    assert robot.links[view.link[slot]] == "upper_arm_link"
    assert abs(view.gap[slot]) < 0.01 and view.eps[slot] >= 0.01


def test_an_obstacle_before_the_body_is_kept(robot, skin, facing):
    assert verdict_at(robot, skin, facing, -0.10)[0] is Verdict.KEPT


def test_a_point_behind_the_body_is_impossible_unless_the_paper_is_followed(robot, skin, facing):
    assert verdict_at(robot, skin, facing, 0.30)[0] is Verdict.BEHIND
    paper = P._replace(two_sided=True, footprint=False)
    assert verdict_at(robot, skin, facing, 0.30, paper)[0] is Verdict.KEPT
    assert verdict_at(robot, skin, facing, 0.0, paper)[0] is Verdict.SELF


def test_the_threshold_grows_with_the_errors_of_the_range(robot, skin):
    depth, judge = np.full(skin.slots, 3.0), SelfFilter(robot, skin)
    eps = judge.judge(np.array([0]), depth, robot.posture(robot.home), P).eps
    noise, share, position, body = 0.0065 * 3.0, 0.015 * 3.0, 0.002, 0.0025
    expected = 2.5 * np.sqrt(noise**2 + share**2 + position**2 + body**2)
    assert eps[0] == pytest.approx(expected)


def test_margins_grow_with_what_is_in_doubt(robot, skin, facing):
    posture, k, z, depth = facing
    at, wide, slot = np.full(skin.slots, depth), {}, 64 * k + z
    for name, share, time in (
        ("known", 0.1, 0.002),
        ("as laid out", 1.0, 0.002),
        ("late", 1.0, 0.03),
    ):
        d = skin.doubt
        doubt = replace(
            d, position=share * d.position, angle=share * d.angle, share=share * d.share
        )
        doubted = replace(skin, doubt=replace(doubt, time=np.full(skin.count, time)))
        qd = np.full(robot.n, 1.0)
        judged = SelfFilter(robot, doubted).judge(np.array([k]), at, posture, P, qd=qd)
        wide[name] = judged.aims.spread[slot], judged.eps[slot]
    for less, more in pairwise(wide.values()):
        assert less[0] < more[0] and less[1] < more[1]
    assert wide["known"][0] > 1.0  # never less than the zone itself


def test_a_moving_link_is_seen_from_its_sensor_as_fast_as_it_moves(robot, skin):
    """The twists of the views against finite differences."""
    rng = np.random.default_rng(4)
    q, qd, step = robot.home + rng.uniform(-0.5, 0.5, robot.n), rng.uniform(-1, 1, robot.n), 1e-6
    judge, k, link = SelfFilter(robot, skin), 7, robot.link_index("upper_arm_link")
    mount = skin.link[k]

    def seen(posture):
        """A point of the link at 0.1 m from its origin, as the sensor's link sees it."""
        T = np.linalg.inv(posture.T_base_link[mount]) @ posture.T_base_link[link]
        return T[:3, :3] @ np.full(3, 0.1) + T[:3, 3], T[:3, :3]

    posture = robot.posture(q)
    hulls, views = judge._hulls, judge._views
    everything = hulls._replace(radius=hulls.radius + 100.0)
    aim(np.array([k]), posture.T_base_link, posture.link_twists(qd), judge.fan, everything, views)
    (p, R), (after, _) = seen(posture), seen(robot.posture(q + step * qd))
    twist = views.twist[link, k]
    velocity = twist[:3] + np.cross(twist[3:], np.full(3, 0.1))
    assert R @ velocity == pytest.approx((after - p) / step, abs=1e-4)


# --- the other verdicts -------------------------------------------------------------------


def judged(robot, skin, rules=P, cell=NO_CELL, now=0.0, **kind):
    cloud = SkinCloud(robot, skin, cell)
    cloud.add_frames([frame(15, 0.0, **kind)], robot.posture(robot.home), rules)
    return cloud.view(now)


def only(view, sensor=15):
    return {Verdict(v) for v in view.verdict[64 * sensor : 64 * sensor + 64]}


def test_each_reason_to_refuse_a_zone_has_its_verdict(robot, skin):
    assert only(judged(robot, skin, status=4)) == {Verdict.BAD_STATUS}
    assert only(judged(robot, skin, status=10)) == {Verdict.BAD_STATUS}
    assert only(judged(robot, skin, status=255)) == {Verdict.NO_TARGET}
    assert only(judged(robot, skin, targets=0)) == {Verdict.NO_TARGET}
    assert only(judged(robot, skin, distance=0.01)) == {Verdict.CONTACT}
    assert only(judged(robot, skin, distance=4.5)) == {Verdict.OUT_OF_RANGE}
    assert only(judged(robot, skin, now=0.21)) == {Verdict.STALE}
    assert only(judged(robot, skin), sensor=16) == {Verdict.EMPTY}


def test_unconfirmed_targets_are_trusted_where_the_type_says_so(robot, skin):
    said = skin.sensors[0].type
    status = msgspec.structs.replace(said.status, trusted=(5, 9, 10))
    trusting = retyped(skin, msgspec.structs.replace(said, status=status), robot)
    assert Verdict.BAD_STATUS not in only(judged(robot, trusting, status=10, distance=0.5))


def test_a_zone_without_a_target_has_no_point(robot, skin):
    view = judged(robot, skin, status=255)
    assert np.isnan(view.points[64 * 15 : 64 * 16]).all()


def test_points_inside_a_box_of_the_cell_are_static(robot, skin):
    everything = Cell(boxes=(Box("all", np.eye(4), np.full(3, 10.0)),))
    kept = only(judged(robot, skin, distance=0.5))
    assert Verdict.KEPT in kept
    assert Verdict.KEPT not in only(judged(robot, skin, cell=everything, distance=0.5))


def test_a_turned_box_holds_what_is_inside_it():
    c = np.cos(np.pi / 4)
    T = np.eye(4)
    T[:2, :2] = [[c, -c], [c, c]]
    T[:3, 3] = [1.0, 0.0, 0.0]
    box = StaticFilter(Cell(boxes=(Box("box", T, np.array([2.0, 0.2, 0.2])),)))
    points = np.array([[1.6, 0.6, 0.0], [1.6, -0.6, 0.0], [np.nan, 0.0, 0.0]])
    assert box.inside(points).tolist() == [True, False, False]


def test_a_frame_is_placed_where_the_arm_was_when_it_was_measured(robot, skin):
    cloud = SkinCloud(robot, skin, Cell())
    posture = robot.posture(robot.home + 0.3)
    cloud.add_frames([frame(0, 0.0, 0.5)], posture, P)
    T = posture.T_base_link[skin.link[0]]
    expected = T[:3, :3] @ (skin.origin[0] + 0.5 * skin.reach[20]) + T[:3, 3]
    assert cloud.view(0.0).points[20] == pytest.approx(expected)


def test_an_older_frame_that_comes_late_does_not_replace_a_newer_one(robot, skin):
    cloud = SkinCloud(robot, skin, Cell())
    posture = robot.posture(robot.home)
    cloud.add_frames([frame(0, 1.0, 0.5)], posture, P)
    before = cloud.view(1.0).points[:64].copy()
    cloud.add_frames([frame(0, 0.9, 0.8)], posture, P)
    assert np.array_equal(cloud.view(1.0).points[:64], before)


def test_health_names_what_a_sensor_does(robot, skin):
    health = SkinHealth(build_skin("four", skin.sensors[:4], robot))
    health.connect(np.array([True, True, True, False]))
    for i in range(20):
        values = 1.0 + 0.001 * (i % 3)  # a sensor that repeats itself would be called frozen
        health.update([frame(0, i / 15, values), frame(1, i / 15, values, status=4)], i / 15)
    states = health.states(19 / 15 + 0.1)
    assert [SensorHealth(s).name for s in states] == ["GOOD", "POOR", "WAITING", "ABSENT"]
    assert health.rates()[0] == pytest.approx(15.0)
    assert SensorHealth(health.states(3.0)[0]) is SensorHealth.STALE
    assert health.silent(19 / 15 + 0.6, 0.5, 0.0) == 3
    assert health.heard_since(19 / 15) and not health.heard_since(19 / 15 + 0.01)


def test_a_link_with_a_calibrated_threshold_uses_it(robot, skin, facing):
    posture, k, z, depth = facing
    eps = np.full((len(robot.links), 2), np.nan)
    eps[robot.link_index("upper_arm_link")] = 0.004, 0.02
    calibrated = replace(robot, eps=eps)
    one_ray = P._replace(footprint=False)
    before = np.full(skin.slots, depth - 0.025)
    verdict = {
        name: SelfFilter(r, skin).judge(np.array([k]), before, posture, one_ray)[0][64 * k + z]
        for name, r in (("general", robot), ("calibrated", calibrated))
    }
    assert verdict == {"general": Verdict.SELF, "calibrated": Verdict.KEPT}


def test_culled_rays_change_no_verdict(robot, skin):
    """Sensors judged alone and together, and boxes that hold everything, agree."""
    judge, blunt = SelfFilter(robot, skin), SelfFilter(robot, skin)
    hulls = blunt._hulls
    blunt._hulls = hulls._replace(
        low=hulls.low - 100.0, high=hulls.high + 100.0, radius=hulls.radius + 100.0
    )
    rng = np.random.default_rng(12)
    everyone = np.arange(skin.count)
    for posture in postures(robot, 20, 13):
        depth = rng.uniform(0.05, 1.5, skin.slots)
        one = P._replace(footprint=False)
        ours, theirs = (f.judge(everyone, depth, posture, one) for f in (judge, blunt))
        assert all(np.array_equal(a, b) for a, b in zip(ours[:5], theirs[:5], strict=True))
        together = judge.judge(everyone, depth, posture, P)
        alone = judge.judge(everyone[7:8], depth, posture, P)
        mine = skin.zones(7)
        parts = zip(alone[:5], together[:5], strict=True)
        assert all(np.array_equal(a[mine], t[mine]) for a, t in parts)


def test_rays_that_were_saved_would_not_have_found_the_robot(robot, skin):
    judge, blunt = SelfFilter(robot, skin), SelfFilter(robot, skin)
    rng = np.random.default_rng(14)
    everyone = np.arange(skin.count)
    saved = found = 0
    for posture in postures(robot, 20, 15):
        body = judge.judge(everyone, np.full(skin.slots, 9.0), posture, P._replace(footprint=False))
        here = np.where(np.isfinite(body.gap), body.gap + 9.0, 0.5)  # at the body, or near it
        depth = np.maximum(here + rng.normal(scale=0.1, size=here.shape), 0.02)
        few = judge.judge(everyone, depth, posture, P)
        hulls = judge._hulls
        blunt._hulls = hulls._replace(low=hulls.low - 100.0, high=hulls.high + 100.0)
        every = blunt.judge(everyone, depth, posture, P)
        assert np.array_equal(few.verdict == Verdict.SELF, every.verdict == Verdict.SELF)
        saved += int((few.aims.rays < every.aims.rays).sum())
        found += int((few.verdict == Verdict.SELF).sum())
    assert saved > 1000 and found > 500
