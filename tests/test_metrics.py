"""Figures of runs beside people: each by its formula, on series that anybody can work out."""

import numpy as np
import pytest

from app.judge import metrics
from app.judge.clouds import SPACING, CloudDistance
from app.judge.contact import led_away
from app.judge.least import NOTHING, LeastDistance, NearestNow
from app.judge.truth import TrueDistance
from app.world.motion import motion_of
from app.world.person import person_bodies
from app.world.shapes import make_shape
from app.world.tables import LineMotion
from app.world.world import Body, World
from tests.test_world import commuter

NEVER = np.inf


@pytest.fixture(scope="module")
def truth(robot):
    return TrueDistance([(b.vertices, b.faces) for b in robot.bodies])


def test_the_paper_s_figures_are_means_of_means_and_the_largest_deviation():
    trials = [np.array([0.1, 0.3]), np.array([0.2, NEVER, 0.4, 0.6])]
    assert metrics.mean_minimum(trials) == pytest.approx((0.2 + 0.4) / 2)
    assert metrics.largest_deviation(trials) == pytest.approx(np.std([0.2, 0.4, 0.6]))
    assert np.isnan(metrics.mean_minimum([np.array([NEVER])]))


def test_shares_contacts_and_jumps_are_counted_as_defined():
    d = np.array([0.0, 0.0, 0.3, -0.01, 0.1, 0.0])
    assert metrics.contacts(d) == 3
    assert metrics.share_below(d, 0.2) == pytest.approx(5 / 6)
    assert metrics.shortfall(d, 0.2) == pytest.approx((3 * 0.2 + 0.21 + 0.1) / 6)
    assert metrics.jumps_per_second(np.array([0.0, 0.04, 0.2, 0.06]), 2.0) == 1.0
    assert metrics.shares(["a", "b", "b", "a", "b"]) == {"b": 0.6, "a": 0.4}
    tool = np.array([[0.0, 0, 0], [0.0, 0, 0]])
    assert metrics.path_error(tool, np.diag([0.03, 0.04, 0.0])[:2]) == pytest.approx(
        np.sqrt((0.03**2 + 0.04**2) / 2)
    )


def test_a_reaction_is_timed_once_an_approach_and_not_where_the_arm_gives_way_already():
    t = np.arange(0.0, 10.0, 0.1)
    d = np.where((t > 1.95) & (t < 3.0) | (t > 5.95) & (t < 7.0), 0.1, 1.0)
    late = np.where((t > 2.25) & (t < 4.0), 1.0, 0.0)
    assert metrics.reaction_times(t, d, late, 0.25) == pytest.approx([0.3, 1.0], abs=1e-9)
    always = np.ones_like(t)
    assert metrics.reaction_times(t, d, always, 0.25) == []
    restless = np.where(t % 0.4 < 0.2, 0.1, 1.0)  # never calm before: one long approach
    assert metrics.reaction_times(t, restless, 0 * t, 0.25) == []


def test_what_is_far_away_need_not_be_seen():
    d, away = np.array([0.5, 0.5, 2.0]), np.array([0.05, 0.5, NEVER])
    assert metrics.seen_share(d, away) == 0.5
    assert np.isnan(metrics.seen_share(np.array([2.0]), np.array([NEVER])))


def test_clouds_are_as_far_apart_as_the_meshes_to_a_few_millimetres(robot, truth):
    T = robot.posture(robot.home).T_base_link
    moving = np.flatnonzero(robot.supports.any(axis=1))
    clouds = CloudDistance(robot, moving)
    assert clouds.measure(T, np.empty((0, 3))) == np.inf
    ball = make_shape({"kind": "sphere", "radius_m": 1e-3}, None, "ball")
    rng, more = np.random.default_rng(1), []
    for _ in range(20):
        at = rng.uniform([-0.6, -0.6, 0.3], [0.8, 0.8, 1.2])
        world = World([])
        world = World([Body("b", ball, (0, 0, 0), motion_of(None, _at(at), "b"))])
        exact = truth.measure(T, world)[moving].min()
        if exact > 0.02:
            found = clouds.measure(T, np.stack([at, at + 5.0]))
            more.append(found - exact)
    assert min(more) > -1e-3 and max(more) < 2 * SPACING and np.median(more) < 2e-3


def _at(p):
    T = np.eye(4)
    T[:3, 3] = p
    return T


def test_the_nearest_of_now_is_the_exact_one_whatever_was_measured_before(robot, truth):
    box = make_shape({"kind": "box", "size_m": (0.1, 0.1, 0.1)}, None, "box")
    there = motion_of(LineMotion(to_m=(0.9, 0.0, 1.0), speed_mps=0.5), _at([0.9, 1.0, 0.5]), "box")
    wall = Body("wall", box, (0, 0, 0), motion_of(None, _at([0.3, 0.3, 0.6]), "w"), False)
    bodies = [*person_bodies(commuter()), Body("box", box, (0, 0, 0), there), wall]
    world = World(bodies)
    links = np.flatnonzero(robot.supports.any(axis=1))
    near = NearestNow(truth, robot, links, world, ["wall"])
    least = LeastDistance(truth, robot, links, world, ["wall"])
    q, smallest = robot.home.copy(), np.inf
    for i in range(40):
        world.step(0.1 * i)
        q = q + 0.01
        T = robot.posture(q).T_base_link
        nearest = truth.nearest(T, world, ["wall"])
        exact = min(nearest[j][0] for j in links)
        found = near.update(T, world.poses())
        smallest = min(smallest, exact)
        assert found.distance == pytest.approx(exact, abs=1e-5)
        assert nearest[found.link][0] == pytest.approx(exact, abs=1e-5)
        body = next(b for b in world.poses() if b.view.name == found.body)
        shape = world.shapes()[found.body]
        pair = truth.closest(found.link, T[found.link], found.body, shape, body.T_base_body)
        assert np.array_equal(found.on_body, pair.on_body)
        assert least.update(T, world.poses()) == pytest.approx(smallest, abs=1e-5)
    empty = NearestNow(truth, robot, links, World([]))
    assert empty.update(T, ()) == NOTHING


def test_the_effort_is_the_integral_of_the_squared_speed():
    assert metrics.effort(np.full((250, 2), 0.5), 125.0) == pytest.approx(2 * 0.25 * 2.0)


def test_the_arm_s_own_reaction_is_timed_by_its_motion_alone():
    t = np.arange(0.0, 6.0, 0.1)
    d = np.where((t > 1.95) & (t < 3.0) | (t > 4.95) & (t < 5.5), 0.3, 1.0)
    led = np.where(t > 2.35, 0.2, -0.1) * (t < 4.0)
    # 0.4 s after the first approach; the second one ends after 0.5 s without any
    assert metrics.own_reaction_times(t, d, led, 0.6) == pytest.approx([0.4, 0.5])
    assert metrics.own_reaction_times(t, d, np.full(len(t), 0.2), 0.6) == []


def test_an_arm_leads_a_link_away_as_fast_as_its_origin_goes(robot):
    posture, qd = robot.posture(robot.home), np.array([0.3, -0.2, 0.1, 0.2, 0.0, 0.1])
    T, tip = posture.T_base_link, robot.link_index("wrist_3_link")
    point = T[tip, :3, 3] + [0.2, 0.1, 0.05]
    later = robot.posture(robot.home + 1e-6 * qd).T_base_link
    nearest = int(np.argmin(np.linalg.norm(T[:, :3, 3] - point, axis=1)))
    far = [np.linalg.norm(x[nearest, :3, 3] - point) for x in (T, later)]
    assert led_away(posture, qd, T, point) == pytest.approx((far[1] - far[0]) / 1e-6, abs=1e-5)
