"""Shapes, motion, people and ray casting of the simulated world."""

import pickle
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from app.actions import MoveObstacle
from app.errors import WorldError
from app.poses import transform
from app.raycast import Beams, no_hits
from app.world.build import FLOOR, FOREARM, HAND, PARTS, SHORT, TALL, UPPER_ARM
from app.world.figure import Stance, figure, hanging_hand
from app.world.gait import CYCLE, stride
from app.world.motion import Along, Circle, Motion, Still
from app.world.person import Plan, Walker, person_bodies, varied
from app.world.route import Route, travel_time, travelled
from app.world.shapes import Shape, make_shape
from app.world.world import Body, World
from tests.fakes import first_hits

HERE = Path(__file__).parent
SHAPES = {
    "sphere": {"kind": "sphere", "radius_m": 0.2},
    "box": {"kind": "box", "size_m": [0.3, 0.5, 0.2]},
    "panel": {"kind": "panel", "size_m": [0.5, 0.4], "thickness_m": 0.05},
    "cylinder": {"kind": "cylinder", "radius_m": 0.2, "length_m": 0.5},
    "capsule": {"kind": "capsule", "radius_m": 0.2, "length_m": 0.4},
}
steady = settings(max_examples=60)
metres = st.floats(-3.0, 3.0)
points = st.tuples(metres, metres, metres)


def signed_distance(kind: str, dims: tuple[float, ...], p: np.ndarray) -> np.ndarray:
    """Exact distance of points (n, 3) in the body frame: the formulae the meshes stand for."""
    if kind == "sphere":
        return np.linalg.norm(p, axis=1) - dims[0]
    if kind in ("box", "panel"):
        q = np.abs(p) - np.array(dims) / 2
    elif kind == "cylinder":
        q = np.column_stack([np.hypot(p[:, 0], p[:, 1]) - dims[0], np.abs(p[:, 2]) - dims[1] / 2])
    else:
        z = np.clip(p[:, 2], -dims[1] / 2, dims[1] / 2)
        return np.linalg.norm(p - z[:, None] * [0, 0, 1], axis=1) - dims[0]
    return np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0)


def traced(kind: str, dims: tuple[float, ...], o: np.ndarray, d: np.ndarray, inside: float):
    """First way (n,) to a point `inside` metres under the exact surface, by small safe steps."""
    t = np.zeros(len(o))
    for _ in range(2000):
        left = signed_distance(kind, dims, o + t[:, None] * d) + inside
        t += np.where((t < 20.0) & (left > 1e-6), left, 0.0)
    return np.where(t < 20.0, t, np.inf)


def rays(seed: int, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from outside that pass the neighbourhood of the origin."""
    rng = np.random.default_rng(seed)
    o = rng.normal(size=(n, 3))
    o *= rng.uniform(0.8, 3.0, (n, 1)) / np.linalg.norm(o, axis=1, keepdims=True)
    d = rng.uniform(-0.3, 0.3, (n, 3)) - o
    return o, d / np.linalg.norm(d, axis=1, keepdims=True)


@cache
def made(kind: str) -> Shape:
    """One of `SHAPES`, made once."""
    return make_shape(SHAPES[kind], HERE, kind)


def body(name: str, kind: str, T: np.ndarray, motion: Motion | None = None) -> Body:
    return Body(name, made(kind), (1, 2, 3), motion or Still(T))


def line(a, b, speed: float = 0.5, loop: bool = True, dwell: float = 0.0) -> Route:
    return Route(np.array([a, b], dtype=float), np.array([dwell, dwell]), speed, loop)


@pytest.mark.parametrize("kind", SHAPES)
def test_hits_lie_within_a_millimetre_of_the_exact_surface(kind):
    o, d = rays(3, 400)
    T = transform(np.array([0.4, -0.2, 0.3]), np.array([0.3, -1.0, 2.0]))
    world = World([body("it", kind, T)])
    hit = first_hits(world, o @ T[:3, :3].T + T[:3, 3], d @ T[:3, :3].T)
    dims = world.shapes()["it"].dims
    surface, under = traced(kind, dims, o, d, 0.0), traced(kind, dims, o, d, 0.001)
    assert np.isfinite(under).sum() > 50 and np.isinf(surface).sum() > 10
    assert (hit >= surface - 1e-5).all()
    assert (hit <= under + 1e-5).all()


@pytest.mark.parametrize("kind", SHAPES)
def test_every_mesh_is_closed_and_faces_outwards(kind):
    shape = made(kind)
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0


def one_by_one(bodies: list[Body], t: float, o: np.ndarray, d: np.ndarray) -> np.ndarray:
    """First hits (n,) of rays (n, 3) by casting all of them at every body, in its own frame."""
    each = []
    for b in bodies:
        R, p = b.motion.pose(t)[:3, :3], b.motion.pose(t)[:3, 3]
        each.append(b.shape.hit.cast(((o - p) @ R).astype(np.float32), (d @ R).astype(np.float32)))
    return np.min(each, axis=0)


@steady
@given(st.integers(0, 2**32 - 1))
def test_what_is_left_out_of_a_cast_or_joined_for_it_never_changes_an_answer(seed):
    # from a seed: drawn one by one, most places would be so simple that nothing is culled
    rng = np.random.default_rng(seed)
    bodies = []
    for i, kind in enumerate(rng.choice(sorted(SHAPES), 8)):
        T = transform(rng.uniform(-1.5, 1.5, 3), rng.uniform(-3, 3, 3))
        walk = Along(line(T[:3, 3], T[:3, 3] + rng.normal(size=3)), T[:3, :3])
        motion = walk if i % 3 == 0 else Still(T)
        bodies.append(Body(f"{kind} {i}", made(kind), (1, 2, 3), motion, i % 3 == 1))
    world, t = World(bodies), rng.uniform(0.0, 5.0)
    world.step(t)
    half_angle, far = rng.uniform(0.05, 1.5), rng.uniform(0.3, 3.0)
    m, n = 3, 100
    origin, axis, d = rng.uniform(-1.5, 1.5, (m, 3)), np.empty((m, 3)), np.empty((m * n, 3))
    for k in range(m):
        a, b = half_angle * np.sqrt(rng.uniform(size=n)), rng.uniform(0, 2 * np.pi, n)
        way = np.column_stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)])
        R = transform(np.zeros(3), rng.uniform(-3, 3, 3))[:3, :3]
        axis[k], d[k * n : (k + 1) * n] = R[:, 2], way @ R.T
    first = np.arange(0, m * n + 1, n)
    hits = no_hits(np.full(m * n, np.float32(far)), -2)
    world.end_rays(Beams(origin, axis, np.full(m, half_angle), first, d), hits)
    true = one_by_one(bodies, t, np.repeat(origin, n, axis=0), d)
    near = np.minimum(true, np.float32(far))
    # a ray that grazes an edge may pass it in one frame and meet it in another
    alike = np.abs(hits.length - near) < 1e-5
    assert np.mean(alike) > 0.995
    assert np.array_equal(hits.label[alike] == -1, hits.length[alike] < np.float32(far))


def test_an_empty_world_and_an_empty_cast_hit_nothing():
    o, d = rays(0, 5)
    assert np.isinf(first_hits(World([]), o, d)).all()
    world = World([body("it", "box", np.eye(4))])
    assert first_hits(world, o[:0], d[:0]).shape == (0,)


def test_rays_that_run_along_an_axis_meet_what_is_there():
    world = World([body("it", "box", np.eye(4))])
    d = np.concatenate([np.eye(3), -np.eye(3)])
    half = np.tile(np.array(SHAPES["box"]["size_m"]) / 2, 2)
    np.testing.assert_allclose(first_hits(world, -d, d), 1.0 - half, atol=1e-6)
    assert np.isinf(first_hits(world, -d + [0.3, 0.3, 0.3], d)).all()


@steady
@given(points, points, st.floats(0.05, 2.0), st.booleans(), st.floats(0.0, 2.0))
def test_a_route_never_jumps_leaves_its_line_or_breaks_its_speed_limit(a, b, speed, loop, dwell):
    a, b = np.array(a), np.array(b)
    if np.linalg.norm(b - a) < 1e-3:
        return
    route = line(a, b, speed, loop, dwell)
    t = np.linspace(-1.0, 2.2 * route.period, 700)
    p = np.array([route.at(float(x)).position for x in t])
    steps = np.linalg.norm(np.diff(p, axis=0), axis=1)
    assert steps.max() <= speed * (t[1] - t[0]) + 1e-9
    u = (b - a) / np.linalg.norm(b - a)
    along = (p - a) @ u
    assert along.min() > -1e-9 and along.max() < np.linalg.norm(b - a) + 1e-9
    assert np.linalg.norm(p - a - along[:, None] * u, axis=1).max() < 1e-9
    assert along.max() > 0.98 * np.linalg.norm(b - a)


@steady
@given(st.floats(0.01, 5.0), st.floats(0.05, 2.0))
def test_speed_is_the_rate_of_the_way(length, speed):
    total, h = travel_time(length, speed), 1e-4
    for t in np.linspace(h, total - h, 60):
        (before, _), (after, _) = (travelled(float(t + s), length, speed) for s in (-h, h))
        rate = travelled(float(t), length, speed)[1]
        assert (after - before) / (2 * h) == pytest.approx(rate, abs=1e-3 * speed)
        assert rate <= speed + 1e-12
    assert travelled(0.0, length, speed) == (0.0, 0.0)
    assert travelled(total, length, speed)[0] == pytest.approx(length)


def test_once_stays_at_the_end_and_to_and_fro_comes_back():
    once = Along(line([0, 0, 0], [1, 0, 0], loop=False), np.eye(3))
    there = Along(line([0, 0, 0], [1, 0, 0]), np.eye(3))
    assert once.pose(100.0)[0, 3] == pytest.approx(1.0)
    assert there.pose(there.route.period)[0, 3] == pytest.approx(0.0)
    assert there.pose(there.route.period / 2)[0, 3] == pytest.approx(1.0)


@steady
@given(points.filter(lambda a: np.linalg.norm(a) > 0.1), st.floats(0.1, 2.0), st.floats(0.5, 20.0),
       st.floats(-50.0, 50.0))  # fmt: skip
def test_a_circle_keeps_its_radius_its_plane_and_its_period(axis, radius, period, t):
    axis = np.array(axis) / np.linalg.norm(axis)
    circle = Circle(np.array([1.0, 2.0, 3.0]), axis, radius, period, 0.3, np.eye(3))
    arm = circle.pose(t)[:3, 3] - circle.centre
    assert np.linalg.norm(arm) == pytest.approx(radius)
    assert abs(arm @ axis) < 1e-9
    np.testing.assert_allclose(circle.pose(t + period)[:3, 3], arm + circle.centre, atol=1e-6)
    ahead = circle.pose(t + period / 1000)[:3, 3] - circle.centre
    assert np.cross(arm, ahead) @ axis > 0


def commuter(loop: bool = True) -> Plan:
    reach = np.array([[-0.30, 0.37, 0.22], [0.70, 0.32, 0.35]])
    return Plan("ann", line([-0.15, 0.64, 0], [0.6, 0.64, 0], 0.6, loop, 3.0), reach)


def ends(pose: np.ndarray, name: str, stature: float) -> tuple[np.ndarray, np.ndarray]:
    """Of the axis of a part's capsule."""
    half = pose[:3, 2] * PARTS[name].length * stature / 2
    return pose[:3, 3] - half, pose[:3, 3] + half


def low_reach() -> Plan:
    """Who takes something from the floor, and puts it far away on a table."""
    reach = np.array([[-0.2, 0.2, -0.55], [0.9, 0.1, 0.1]])
    return replace(commuter(), reach=reach, stature=1.9)


@pytest.mark.parametrize("plan", [commuter(), low_reach()])
def test_a_person_never_jumps_and_stays_in_one_piece(plan):
    walker = Walker(plan)
    t = np.arange(0.0, 1.1 * walker.plan.route.period, 0.004)
    poses = [walker.poses(float(x)) for x in t]
    for name in poses[0]:
        at = np.array([ends(p[name], name, plan.stature) for p in poses])
        steps = np.linalg.norm(np.diff(at, axis=0), axis=2)
        assert steps.max() < 3.5 * 0.004, name
        R = np.array([p[name][:3, :3] for p in poses])
        assert np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max() < 1e-9
    for p in poses[::50]:
        for side in ("left", "right"):
            for limb in (("upper arm", "forearm", "hand"), ("thigh", "shank")):
                names = [f"{side} {part}" for part in limb]
                joined = [ends(p[n], n, plan.stature) for n in names]
                for upper, lower in pairwise(joined):
                    np.testing.assert_allclose(upper[1], lower[0], atol=1e-9)


def test_a_hand_reaches_its_target_and_comes_back():
    for plan in (commuter(), low_reach()):
        walker = Walker(plan)
        for stop in (0, 1):
            t = plan.route.starts[2 * stop]
            _, hand = ends(walker.poses(t + 1.5)["right hand"], "right hand", plan.stature)
            np.testing.assert_allclose(hand, plan.reach[stop], atol=1e-9)
            _, hand = ends(walker.poses(t + 2.9)["right hand"], "right hand", plan.stature)
            assert np.linalg.norm(hand - plan.reach[stop]) > 0.2


def test_who_reaches_low_bows_and_squats_and_who_need_not_stands_upright():
    upright, low = Walker(commuter()).poses(1.5), Walker(low_reach()).poses(1.5)
    assert upright["chest"][2, 2] == pytest.approx(1.0)
    assert low["chest"][2, 2] < 0.9 and low["left thigh"][2, 2] < -0.5  # it points down, less so
    for poses, stature in ((upright, 1.75), (low, 1.9)):
        for side in ("left", "right"):
            heel, toe = ends(poses[f"{side} foot"], f"{side} foot", stature)
            assert heel[2] == pytest.approx(toe[2]) == pytest.approx(FLOOR + 0.022 * stature)


def test_a_hand_stops_where_the_arm_ends():
    far = replace(commuter(), reach=np.array([[-0.3, -3.0, 0.2]] * 2))
    poses = Walker(far).poses(1.5)
    shoulder, _ = ends(poses["right upper arm"], "right upper arm", 1.75)
    _, hand = ends(poses["right hand"], "right hand", 1.75)
    arm = 1.75 * (UPPER_ARM + FOREARM + HAND)
    assert np.linalg.norm(hand - shoulder) == pytest.approx(0.997 * arm)


def test_joints_turn_as_far_as_people_s_do_and_steps_grow_with_the_speed():
    hip, knee, ankle = np.degrees(CYCLE).T
    assert hip.max() == pytest.approx(22, abs=1) and hip.min() == pytest.approx(-11, abs=1)
    assert knee.max() == pytest.approx(64, abs=1) and knee.min() > -1.0
    assert -21 < ankle.min() < -19 and 9 < ankle.max() < 11
    # a walk of 1.3 m/s: strides near 1.4 m, at about 110 steps a minute
    assert stride(1.3, 1.75) == pytest.approx(1.44, abs=0.05)
    assert 120 * 1.3 / stride(1.3, 1.75) == pytest.approx(108, abs=3)
    assert stride(0.6, 1.75) < stride(1.3, 1.75) < stride(1.3, 1.95)


def test_a_seed_draws_stature_habits_and_order_and_the_same_seed_the_same():
    plan = replace(commuter(), route=three_stops(), reach=np.full((3, 3), np.nan))
    drawn = [varied(plan, np.random.default_rng(i), True, True) for i in range(40)]
    tall = np.array([p.stature for p in drawn])
    assert SHORT <= tall.min() < 1.60 and 1.90 < tall.max() <= TALL
    again = varied(plan, np.random.default_rng(0), True, True)
    np.testing.assert_array_equal(again.route.stops, drawn[0].route.stops)
    for p in drawn:
        ways = np.diff(p.route.stops, axis=0, append=p.route.stops[:1])
        assert np.linalg.norm(ways, axis=1).min() > 0.5  # never to where it stands
    assert len({tuple(np.round(p.route.stops[:6, 0])) for p in drawn}) > 5
    kept = varied(replace(plan, stature=1.6), np.random.default_rng(0), False, False)
    assert kept.stature == 1.6 and len(kept.route.stops) == 3


def three_stops() -> Route:
    return Route(np.array([[0.0, 1, 0], [1, 1, 0], [2, 1, 0]]), np.full(3, 3.0), 0.6)


def test_several_persons_walk_in_one_world():
    other = replace(commuter(), name="bea", start=3.0, stature=1.6)
    world = World([*person_bodies(commuter()), *person_bodies(other)])
    world.step(2.0)
    names = [p.view.name for p in world.poses()]
    assert len(names) == len(set(names)) == 2 * len(PARTS) and len(PARTS) == 17


def test_a_person_walks_on_the_floor_and_is_a_pure_function_of_time():
    plan = commuter()
    bodies = person_bodies(plan)
    world, again = World(bodies), World(person_bodies(plan))
    lowest = []
    for t in np.arange(0.0, 9.0, 0.1):
        world.step(float(t))
        lowest.append(min((p.view.vertices @ p.T_base_body[2, :3]).min() + p.T_base_body[2, 3]
                          for p in world.poses()))  # fmt: skip
    assert min(lowest) > -0.751 and max(lowest) < -0.748
    again.step(8.9)
    for a, b in zip(world.poses(), again.poses(), strict=True):
        np.testing.assert_array_equal(a.T_base_body, b.T_base_body)


def test_views_stay_the_same_objects_while_poses_change():
    script = Along(line([0, 0, 0], [1, 0, 0]), np.eye(3))
    world = World([body("it", "box", np.eye(4), script)])
    before = world.poses()[0]
    world.step(1.0)
    after = world.poses()[0]
    assert after.view is before.view
    assert after.T_base_body[0, 3] > 0.1 and before.T_base_body[0, 3] == 0.0
    assert not after.T_base_body.flags.writeable


def test_a_moved_body_stops_following_its_script():
    script = Along(line([0, 0, 0], [1, 0, 0]), np.eye(3))
    world = World([body("it", "box", np.eye(4), script)])
    world.move("it", transform(np.array([0.0, 2.0, 0.0]), np.zeros(3)))
    world.step(1.0)
    np.testing.assert_array_equal(world.poses()[0].T_base_body[:3, 3], [0.0, 2.0, 0.0])
    hit = first_hits(world, np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]))
    assert hit[0] == pytest.approx(1.75, abs=1e-5)


def test_added_bodies_get_their_own_names_and_colours_and_can_be_removed():
    world = World([])
    names = [world.add("", SHAPES["box"], (i, 0, 0)) for i in range(3)]
    names += [world.add("cup", SHAPES["sphere"], (0, i, 0)) for i in range(2)]
    assert names == ["box 1", "box 2", "box 3", "cup", "cup 1"]
    assert len({p.view.colour for p in world.poses()}) == 5
    world.remove("box 2")
    assert world.add("", SHAPES["box"], (0, 0, 1)) == "box 2"
    for name in list(world.shapes()):
        world.remove(name)
    assert world.poses() == ()


def test_a_copy_that_is_told_of_every_edit_keeps_step():
    world = World([*person_bodies(commuter()), body("cup", "box", np.eye(4))])
    copy = pickle.loads(pickle.dumps(world))
    world.follow(lambda edit: copy.edit(pickle.loads(pickle.dumps(edit))))
    for _ in range(3):
        world.add("ball", SHAPES["sphere"], (1.0, 2.0, 3.0))
    world.move("ball 1", transform(np.array([0.0, 2.0, 0.0]), np.zeros(3)))
    world.remove("ball")
    with pytest.raises(WorldError):
        world.remove("ball")  # what is refused here is not told there
    world.edit(MoveObstacle("cup", transform(np.ones(3), np.ones(3))))
    for each in (world, copy):
        each.step(7.0)
    assert list(world.shapes()) == list(copy.shapes())
    for a, b in zip(world.poses(), copy.poses(), strict=True):
        np.testing.assert_array_equal(a.T_base_body, b.T_base_body)
        assert a.view.colour == b.view.colour
    o, d = rays(5, 300)
    np.testing.assert_array_equal(first_hits(world, o, d), first_hits(copy, o, d))


def test_a_person_cannot_be_dragged_or_removed():
    world = World([*person_bodies(commuter()), body("cup", "box", np.eye(4))])
    for change in (lambda: world.move("ann/chest", np.eye(4)), lambda: world.remove("ann/chest")):
        with pytest.raises(WorldError, match=r"'ann/chest'.*known: cup$"):
            change()
    with pytest.raises(WorldError, match=r"no body 'cop'.*did you mean 'cup'"):
        world.remove("cop")
    with pytest.raises(WorldError, match="4x4"):
        world.move("cup", np.full((4, 4), np.nan))


@pytest.mark.parametrize(
    ("table", "told"),
    [
        ({}, "has no kind; known: box, capsule, cylinder, mesh, panel, sphere"),
        ({"kind": "spere"}, "unknown shape kind 'spere'; did you mean 'sphere'?"),
        ({"kind": ["box"]}, "unknown shape kind"),
        ({"kind": "box"}, "box: key 'size_m' is missing"),
        ({"kind": "box", "size": [1, 1, 1]}, "unknown key 'size'; did you mean 'size_m'?"),
        ({"kind": "box", "size_m": [1, 1]}, "give 3 finite numbers"),
        ({"kind": "box", "size_m": [1, 0, 1]}, "give numbers above zero"),
        ({"kind": "box", "size_m": [1, "2", 1]}, "give 3 finite numbers"),
        ({"kind": "sphere", "radius_m": -1}, "radius_m = -1; give a number above zero"),
        ({"kind": "sphere", "radius_m": float("inf")}, "give a finite number"),
        ({"kind": "sphere", "radius_m": True}, "give a finite number"),
        ({"kind": "capsule", "radius_m": 0.1}, "key 'length_m' is missing"),
        ({"kind": "panel", "size_m": [1, 1], "thickness_m": 0}, "above zero"),
        ({"kind": "mesh", "file": "none.stl"}, "none.stl is missing"),
        ({"kind": "mesh", "file": 7}, "give a text in quotes"),
        ({"kind": "mesh", "file": "bad.glb"}, "not a readable mesh"),
        ({"kind": "mesh", "file": "points.ply"}, "has no faces"),
    ],
)  # fmt: skip
def test_a_bad_shape_is_told_in_one_line_that_begins_with_its_place(table, told, tmp_path):
    (tmp_path / "bad.glb").write_text("nothing of the kind")
    (tmp_path / "points.ply").write_bytes(trimesh.PointCloud(np.eye(3)).export(file_type="ply"))
    with pytest.raises(WorldError) as e:
        make_shape(table, tmp_path, "cell.toml: body 'it'")
    assert told in str(e.value)
    assert str(e.value).startswith("cell.toml: body 'it'") and "\n" not in str(e.value)


def test_a_mesh_file_is_scaled_and_hit(tmp_path):
    trimesh.creation.box((1000.0, 1000.0, 1000.0)).export(tmp_path / "crate.stl")
    shape = make_shape({"kind": "mesh", "file": "crate.stl", "scale": 0.001}, tmp_path, "it")
    o, d = np.array([[2, 0.1, 0]], np.float32), np.array([[-1, 0, 0]], np.float32)
    assert shape.hit.cast(o, d)[0] == pytest.approx(1.5, abs=1e-6)


@pytest.mark.parametrize("hand", [0, 1])
def test_a_hand_that_hangs_is_where_the_whole_figure_has_it(hand):
    stance = Stance(np.array([[0.2, 0.1, 0.0], [-0.3, 0.4, 0.1]]), np.array([0.3, -0.2]), 0.4, 0.2)
    ends = dict(zip(PARTS, figure(stance, 1.7), strict=True))
    name = [n for n in PARTS if "hand" in n][hand]
    assert np.array_equal(hanging_hand(stance, 1.7, hand), ends[name][1])
