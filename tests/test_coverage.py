"""What a skin sees of what comes to its arm: the map of first sight, and its judges."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.coverage.cones import cones_of, packed
from app.coverage.first_seen import first_seen
from app.coverage.look import Look, Subject, look, subject_of
from app.coverage.patches import patches_of, round_of
from app.coverage.thrown import throw
from app.messages import freeze
from app.robot.skin import Skin, build_skin

FEW = 600  # patches


@pytest.fixture(scope="module")
def subject(robot, skin) -> Subject:
    return subject_of(robot, skin, FEW)


@pytest.fixture(scope="module")
def home(robot, subject) -> Look:
    return look(subject, robot.posture(robot.home))


def some(skin: Skin, which, robot) -> Skin:
    """A skin of these sensors alone."""
    return build_skin("some", tuple(skin.sensors[k] for k in which), robot)


def bare(skin: Skin, robot, **changed) -> Skin:
    """The first sensor at the origin of its link, with changes."""
    sensor = replace(skin.sensors[0], T_link_sensor=freeze(np.eye(4)), **changed)
    return build_skin("one", (sensor,), robot)


def lines(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """n patches before a sensor at the origin that looks along z, one line to each."""
    rng = np.random.default_rng(seed)
    point = rng.uniform((-0.8, -0.8, -0.2), (0.8, 0.8, 0.8), (n, 3))
    way = rng.normal(size=(n, 1, 3))
    return point, way / np.linalg.norm(way, axis=2, keepdims=True)


def test_patches_share_the_arms_area_and_are_always_the_same(robot) -> None:
    a, b = patches_of(robot, FEW), patches_of(robot, FEW)
    assert all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))
    for i, body in enumerate(robot.bodies):
        c = body.vertices[body.faces]
        area = np.linalg.norm(np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]), axis=1).sum() / 2
        assert a.area[a.link == i].sum() == pytest.approx(area)
    assert len(a.link) == pytest.approx(FEW, abs=len(robot.links))
    assert (np.einsum("pmi,pi->pm", a.direction, a.normal) > 0.4).all()


def test_the_kernel_agrees_with_dense_rays_and_small_steps(robot, skin) -> None:
    """Brute force: 11 x 11 rays a zone, every 8 mm of the line."""
    one = bare(skin, robot)
    cones, radius, far = cones_of(one), 0.05, 1.2
    rng = np.random.default_rng(3)
    free = rng.uniform(0.2, 1.3, one.slots)
    point, way = lines(24, 4)
    found = first_seen(
        point, way, np.zeros((24, 1), bool), np.eye(4)[None], packed(cones, free), radius, far
    )[0, :, 0]  # fmt: skip
    for p in range(24):
        # the rays are up to 12 mm apart, so that a sphere may slip between them
        late, early = (dense(point[p], way[p, 0], free, r, far) for r in (0.044, 0.056))
        assert late - 0.01 <= found[p] + radius <= early + 0.01 or found[p] == late == 0.0, p
    assert (found > 0.0).sum() > 5


def dense(x, u, free, radius, far):
    """The largest t at which a sphere at x + t u meets a ray within the zones' views; 0: never."""
    inner = np.tile(np.abs(np.arange(15) - 7) <= 5, 8)  # up to the outermost ray of each zone
    a = (np.radians(45.0) * ((np.arange(120) + 0.5) / 120 - 0.5))[inner]
    down, across = np.meshgrid(np.tan(a), np.tan(a), indexing="ij")
    ray = np.stack((across, down, np.ones_like(across)), axis=2).reshape(-1, 3)
    ends = free.reshape(8, 8).repeat(11, axis=0).repeat(11, axis=1).ravel()  # depths
    square = np.einsum("ni,ni->n", ray, ray)
    for t in np.arange(far + 0.05, 0.05, -0.008):
        c = x + t * u
        along = ray @ c
        inside = along**2 - square * (c @ c - radius**2)
        depth = (along - np.sqrt(inside.clip(min=0.0))) / square
        if ((inside > 0.0) & (along > 0.0) & (depth < ends)).any():
            return t
    return 0.0


@given(st.sets(st.integers(0, 29), min_size=1))
def test_more_sensors_never_lower_coverage(robot, skin, subject, home, which) -> None:
    kept = np.isin(np.arange(30), list(which))
    fewer, all_ = home.seen(kept), home.seen()
    assert (fewer <= all_)[~home.barred].all()
    assert np.array_equal(np.isnan(fewer), home.barred)


def test_what_a_sensor_gives_does_not_depend_on_the_others(robot, skin, home) -> None:
    few = subject_of(robot, some(skin, (3, 17), robot), FEW)
    alone = look(few, robot.posture(robot.home))
    assert np.array_equal(alone.gap, home.gap[[3, 17]])


def test_a_symmetric_layout_gives_a_symmetric_map(robot, skin) -> None:
    """Four sensors round an axis see a quarter turn of the patches as they see the patches."""
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    T = np.tile(np.eye(4), (4, 1, 1))
    T[0, :3, 3] = (0.0, 0.0, 0.06)
    for k in range(1, 4):
        T[k, :3] = turn @ T[k - 1, :3]
    one = bare(skin, robot)
    eyes = np.tile(packed(cones_of(one), np.full(one.slots, 1.3)), (4, 1))
    rng = np.random.default_rng(5)
    normal = rng.normal(size=(80, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    point, way = normal * (0.05, 0.3, 0.05), round_of(normal)
    nothing = np.zeros(way.shape[:2], bool)
    here = first_seen(point, way, nothing, T, eyes, 0.05, 1.5)
    there = first_seen(point @ turn.T, way @ turn.T, nothing, T, eyes, 0.05, 1.5)
    assert there.max(axis=0) == pytest.approx(here.max(axis=0), abs=2e-3)
    assert (here > 0).mean() > 0.05


def test_how_a_sensor_is_turned_in_its_mounting_changes_nothing(robot, skin) -> None:
    point, way = lines(200, 6)
    free = np.arange(64.0).reshape(8, 8) / 100.0 + 0.3
    nothing, maps = np.zeros((200, 1), bool), []
    # seen clockwise: what is the upper left zone of the straight one
    for rotation, seen in ((0, free), (180, free[::-1, ::-1])):
        cones = cones_of(bare(skin, robot, rotation_deg=rotation))
        eyes = packed(cones, seen.ravel())
        maps.append(first_seen(point, way, nothing, np.eye(4)[None], eyes, 0.05, 1.5))
    assert np.allclose(maps[0], maps[1], atol=1e-6)
    mirrored = cones_of(bare(skin, robot, mirrored=True))
    eyes = packed(mirrored, free[:, ::-1].ravel())
    assert np.allclose(
        maps[0], first_seen(point, way, nothing, np.eye(4)[None], eyes, 0.05, 1.5), atol=1e-6
    )


def test_a_sensor_that_looks_into_the_arm_is_hidden(robot, skin) -> None:
    T = np.array(skin.sensors[0].T_link_sensor)
    T[:3, :3] = T[:3, :3] @ np.diag((1.0, -1.0, -1.0))  # turned over
    into = replace(skin.sensors[0], T_link_sensor=freeze(T))
    two = build_skin("two", (into, skin.sensors[1]), robot)
    seen = look(subject_of(robot, two, FEW), robot.posture(robot.home))
    assert seen.hidden.tolist() == [True, False]
    assert seen.views.lost[:64].mean() > 0.9
    assert (seen.gap[0] > 0.0).mean() < 0.01 < (seen.gap[1] > 0.0).mean()


def test_what_is_thrown_is_seen_where_it_was_predicted(robot, subject, home) -> None:
    thrown = throw(subject, home, robot.posture(robot.home), 8, 1)
    assert thrown.agreed.all()
    assert (thrown.simulated > 0.0).sum() > 4


@pytest.mark.slow
def test_ten_thousand_thrown_spheres_are_seen_where_it_was_predicted(robot, subject) -> None:
    rng = np.random.default_rng(7)
    agreed = []
    for i in range(10):
        q = robot.home + rng.uniform(-0.6, 0.6, robot.n)
        posture = robot.posture(q)
        agreed.append(throw(subject, look(subject, posture), posture, 1000, i).agreed)
    assert np.mean(agreed) >= 0.97
