"""Algorithm 2 against a float64 brute force that shares no code with it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.messages import Verdict
from app.perception.field import surveyed
from app.perception.proximity import BodyPairs, MountPairs
from app.robot.meshes import BodyMesh
from tests.fakes import cloud_of


def brute_distance(points, triangles):
    """(n,) unsigned distance to triangles: the plane where the foot falls inside, else edges."""
    best = np.full(len(points), np.inf)
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(area, 1e-300)[:, None]
    for i, p in enumerate(points):
        height = np.einsum("ij,ij->i", p - a, unit)
        foot = p - height[:, None] * unit
        inside = np.ones(len(a), dtype=bool)
        for s, e in ((a, b), (b, c), (c, a)):
            inside &= np.einsum("ij,ij->i", np.cross(e - s, foot - s), unit) >= 0.0
        d = np.where(inside & (area > 0), np.abs(height), np.inf)
        for s, e in ((a, b), (b, c), (c, a)):
            edge = e - s
            length2 = np.maximum(np.einsum("ij,ij->i", edge, edge), 1e-300)
            t = np.clip(np.einsum("ij,ij->i", p - s, edge) / length2, 0.0, 1.0)
            d = np.minimum(d, np.linalg.norm(p - s - t[:, None] * edge, axis=1))
        best[i] = d.min()
    return best


def signed_brute(points, body):
    triangles = body.vertices[body.faces]
    d = brute_distance(points, triangles)
    return np.where(winding_number(points, triangles) > 0.5, -d, d)


def winding_number(points, triangles):
    """(n,) solid angle over 4 pi: 1 inside, 0 outside (Van Oosterom and Strackee, 1983)."""
    a, b, c = (triangles[None, :, k] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    up = np.einsum("nij,nij->ni", a, np.cross(b, c))
    down = la * lb * lc
    for u, v, w in ((a, b, lc), (b, c, la), (c, a, lb)):
        down += np.einsum("nij,nij->ni", u, v) * w
    return np.arctan2(up, down).sum(axis=1) / (2 * np.pi)


def test_the_closest_pair_of_every_link_equals_a_brute_force_on_80_postures(robot):
    rng = np.random.default_rng(3)
    search = BodyPairs(robot)
    worst = 0.0
    for _ in range(80):
        posture = robot.posture(rng.uniform(-np.pi, np.pi, robot.n))
        centre = posture.T_base_link[rng.integers(7), :3, 3]
        points = centre + rng.normal(scale=rng.choice([0.1, 0.5]), size=(6, 3))
        pairs = search.update(cloud_of(points), posture)
        for link, body in enumerate(robot.bodies):
            T = posture.T_base_link[link]
            d = signed_brute((points - T[:3, 3]) @ T[:3, :3], body)
            worst = max(worst, abs(d.min() - pairs.distance[link]))
            assert pairs.slot[link] == d.argmin() or np.isclose(d[pairs.slot[link]], d.min())
        assert pairs.closest == 1 + pairs.distance[1:].argmin()  # the base is never acted on
    assert worst < 1e-5


@pytest.fixture(scope="module")
def search(robot):
    return BodyPairs(robot)


def test_the_normal_points_from_the_world_to_the_robot_and_spans_the_distance(robot):
    rng = np.random.default_rng(4)
    posture = robot.posture(robot.home)
    pairs = BodyPairs(robot).update(cloud_of(rng.uniform(-1, 1, (50, 3))), posture)
    assert np.allclose(np.linalg.norm(pairs.normal, axis=1), 1.0)
    assert np.allclose(pairs.on_world + pairs.distance[:, None] * pairs.normal, pairs.on_robot)


def test_a_point_inside_a_link_has_negative_distance_and_the_deepest_one_wins(robot):
    posture = robot.posture(robot.home)
    forearm = robot.link_index("forearm_link")
    T = posture.T_base_link[forearm]
    deep, shallow = np.array([-0.3, 0.0, 0.0393]), np.array([-0.3, 0.035, 0.0393])
    points = np.stack([T[:3, :3] @ p + T[:3, 3] for p in (shallow, deep)])
    pairs = BodyPairs(robot).update(cloud_of(points), posture)
    assert pairs.distance[forearm] < -0.035
    assert pairs.slot[forearm] == 1
    # retreat leads out of the body: moving the link along the normal frees the point
    assert np.dot(pairs.normal[forearm], pairs.on_robot[forearm] - points[1]) < 0.0


def test_a_touching_point_still_has_a_unit_retreat_direction(robot):
    posture = robot.posture(robot.home)
    body, link = robot.bodies[3], 3
    T = posture.T_base_link[link]
    corner = body.vertices[body.faces[100]].mean(axis=0)
    pairs = BodyPairs(robot).update(cloud_of((T[:3, :3] @ corner + T[:3, 3])[None]), posture)
    assert abs(pairs.distance[link]) < 1e-9
    assert np.linalg.norm(pairs.normal[link]) == pytest.approx(1.0)


def test_an_empty_cloud_has_no_pair_and_infinite_distance(robot):
    posture = robot.posture(robot.home)
    pairs = BodyPairs(robot).update(cloud_of(np.empty((0, 3))), posture)
    assert pairs.closest == -1 and pairs.minimum == np.inf
    assert (pairs.slot == -1).all() and np.isnan(pairs.on_world).all()


def test_rows_that_are_not_kept_or_not_a_number_are_passed_over(robot):
    posture = robot.posture(robot.home)
    points = np.array([[0.0, 0.0, 0.5], [np.nan, 0.0, 0.0], [5.0, 0.0, 0.0]])
    verdict = np.array([Verdict.SELF, Verdict.KEPT, Verdict.KEPT], dtype=np.uint8)
    pairs = BodyPairs(robot).update(cloud_of(points, verdict), posture)
    assert (pairs.slot == 2).all()


@settings(max_examples=40)
@given(seed=st.integers(0, 2**31), n=st.integers(1, 60))
def test_the_answer_does_not_depend_on_order_or_on_what_was_asked_before(robot, search, seed, n):
    rng = np.random.default_rng(seed)
    posture = robot.posture(rng.uniform(-3, 3, robot.n))
    points = rng.uniform(-1, 1, (n, 3))
    search.reset()
    fresh = search.update(cloud_of(points[::-1].copy()), posture)
    search.update(cloud_of(rng.uniform(-1, 1, (n, 3))), posture)
    assert np.array_equal(search.update(cloud_of(points), posture).distance, fresh.distance)


def test_mount_pairs_are_the_nearest_points_to_the_lenses(robot, skin):
    rng = np.random.default_rng(5)
    posture = robot.posture(robot.home)
    points = rng.uniform(-1, 1, (200, 3))
    pairs = MountPairs(skin).update(cloud_of(points), posture)
    T = posture.T_base_link[skin.link]
    lens = np.einsum("kij,kj->ki", T[:, :3, :3], skin.origin) + T[:, :3, 3]
    brute = np.linalg.norm(lens[:, None] - points, axis=2)
    assert np.allclose(pairs.distance, brute.min(axis=1))
    assert np.array_equal(pairs.slot, brute.argmin(axis=1))


def test_an_open_mesh_has_unsigned_distances(robot):
    from dataclasses import replace

    sheet = BodyMesh(
        np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], dtype=np.int64)
    )
    posture = robot.posture(robot.home)
    arm = replace(robot, bodies=(sheet,), links=("sheet",), supports=np.ones((1, 6)))
    T = posture.T_base_link[0]
    for z in (-0.2, 0.2):
        point = T[:3, :3] @ [0.2, 0.2, z] + T[:3, 3]
        assert BodyPairs(arm).update(cloud_of(point[None]), posture).minimum == pytest.approx(0.2)


def test_distance_tables_are_made_once_for_the_same_meshes_and_cannot_be_written_to(robot):
    forest, field = surveyed(robot.bodies)
    again = [BodyMesh(b.vertices.copy(), b.faces.copy()) for b in robot.bodies]
    assert surveyed(again)[1] is field
    assert not any(array.flags.writeable for array in (*forest, field))
    assert surveyed(robot.bodies[1:])[1].shape == (len(robot.bodies) - 1, *field.shape[1:])
