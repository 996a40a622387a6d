"""The true distance, judged by brute force over dense samples of the link."""

import numpy as np
import pytest
import trimesh

from app.errors import WorldError
from app.judge.truth import TrueDistance
from app.poses import transform
from app.world.motion import Still
from app.world.shapes import make_shape
from app.world.world import Body, World
from tests.test_world import SHAPES, signed_distance

# off its frame's middle and across its axes, so that its bounding box is mostly empty
LINK = trimesh.creation.capsule(height=0.4, radius=0.06, count=[24, 24])
LINK.apply_transform(transform(np.array([0.10, 0.05, -0.08]), np.array([0.6, 0.7, 0.0])))
SAMPLES, _ = trimesh.sample.sample_surface(LINK, 20000, seed=4)


def world_of(**poses: np.ndarray) -> World:
    """One body of each named kind at its pose."""
    return World(
        Body(k, make_shape(SHAPES[k], None, k), (0, 0, 0), Still(T)) for k, T in poses.items()
    )


def links(n: int = 1) -> TrueDistance:
    return TrueDistance([(LINK.vertices, LINK.faces)] * n)


def random_pose(rng: np.random.Generator, reach: float) -> np.ndarray:
    return transform(rng.uniform(-reach, reach, 3), rng.uniform(-3, 3, 3))


def brute(T_base_link: np.ndarray, kind: str, T_base_body: np.ndarray) -> float:
    base = SAMPLES @ T_base_link[:3, :3].T + T_base_link[:3, 3]
    dims = make_shape(SHAPES[kind], None, kind).dims
    local = (base - T_base_body[:3, 3]) @ T_base_body[:3, :3]
    return float(signed_distance(kind, dims, local).min())


@pytest.mark.parametrize("kind", SHAPES)
def test_distances_agree_with_brute_force(kind):
    rng, truth, apart = np.random.default_rng(7), links(), 0
    for _ in range(40):
        T_link, T_body = random_pose(rng, 0.5), random_pose(rng, 0.5)
        expected = brute(T_link, kind, T_body)
        found = float(truth.measure(T_link[None], world_of(**{kind: T_body}))[0])
        if expected > 0.0:
            apart += 1
            assert expected - 0.004 < found <= expected + 1e-6
        elif expected < -0.004:
            assert found <= 0.0
    assert 10 < apart < 40


def test_the_nearest_of_many_is_found_whatever_is_culled():
    rng = np.random.default_rng(8)
    for _ in range(20):
        poses = {k: random_pose(rng, 1.2) for k in SHAPES}
        T_links = np.array([random_pose(rng, 1.0) for _ in range(3)])
        found = links(3).nearest(T_links, world_of(**poses))
        for T, (distance, name) in zip(T_links, found, strict=True):
            single = {k: links().measure(T[None], world_of(**{k: p}))[0] for k, p in poses.items()}
            assert distance == pytest.approx(min(single.values()), abs=1e-6)
            assert single[name] == pytest.approx(distance, abs=1e-6)


def test_mesh_bodies_are_measured_like_the_solids_that_they_show(tmp_path):
    trimesh.creation.box(SHAPES["box"]["size_m"]).export(tmp_path / "box.stl")
    shape = make_shape({"kind": "mesh", "file": "box.stl"}, tmp_path, "box")
    rng, truth = np.random.default_rng(9), links()
    for _ in range(10):
        T_link, T = random_pose(rng, 1.0)[None], random_pose(rng, 1.0)
        solid = float(truth.measure(T_link, world_of(box=T))[0])
        mesh = float(truth.measure(T_link, World([Body("m", shape, (0, 0, 0), Still(T))]))[0])
        assert mesh == pytest.approx(solid, abs=1e-4) if solid > 0 else mesh <= 0


def test_a_named_body_can_be_left_out_and_an_unknown_name_is_told():
    near, far = transform(np.array([0.4, 0, 0]), np.zeros(3)), transform(np.ones(3), np.zeros(3))
    world = world_of(sphere=near, box=far)
    T = np.eye(4)[None]
    assert links().nearest(T, world)[0][1] == "sphere"
    assert links().nearest(T, world, leave_out=["sphere"])[0][1] == "box"
    assert links().nearest(T, world, leave_out=["sphere", "box"]) == [(np.inf, "")]
    with pytest.raises(WorldError, match=r"no body 'bax'.*did you mean 'box'"):
        links().measure(T, world, leave_out=["bax"])


def test_the_distance_follows_a_body_that_moves_and_one_that_is_added():
    truth, T = links(), np.linalg.inv(transform(np.array([0.10, 0.05, -0.08]), np.zeros(3)))
    start = transform(np.array([0.0, 0.0, 1.0]), np.zeros(3))
    world = world_of(sphere=start)
    before = truth.measure(T[None], world)[0]
    assert before == pytest.approx(brute(T, "sphere", start), abs=4e-3)
    start[2, 3] = 0.8
    world.move("sphere", start)
    assert before - 0.2 < truth.measure(T[None], world)[0] < before - 0.1
    world.add("ball", {"kind": "sphere", "radius_m": 0.1}, (0.0, 0.0, -0.4))
    assert truth.nearest(T[None], world)[0][1] == "ball"
