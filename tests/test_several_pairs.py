"""Several well-separated pairs a link, and holding on to a control point."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.perception.proximity import PAIRS, RENEW, BodyPairs, HeldPairs, ManyPairs
from app.perception.spread import APART, LOOKS, TURN, VOXEL
from tests.fakes import cloud_of
from tests.test_proximity import signed_brute


def found(robot, points, posture, reach=0.6):
    search = BodyPairs(robot)
    use = np.ones(len(points), dtype=bool)
    closest = search.search(points, use, posture)
    return closest, search.several(points, use, posture, closest, reach)


def test_the_first_of_several_pairs_is_the_closest_and_all_are_true_distances(robot):
    rng = np.random.default_rng(20)
    for _ in range(20):
        posture = robot.posture(rng.uniform(-3, 3, robot.n))
        points = posture.T_base_link[3, :3, 3] + rng.normal(scale=0.3, size=(15, 3))
        closest, many = found(robot, points, posture)
        assert np.array_equal(many.distance[::PAIRS], closest.distance)
        rows = many.distance.reshape(-1, PAIRS)
        finite = np.where(np.isfinite(rows), rows, 1e9)
        assert (np.diff(finite, axis=1) >= -1e-12).all()
        for link, body in enumerate(robot.bodies):
            T = posture.T_base_link[link]
            d = signed_brute((points - T[:3, 3]) @ T[:3, :3], body)
            for i in range(PAIRS):
                slot = many.slot[link * PAIRS + i]
                if slot >= 0:
                    assert rows[link, i] == pytest.approx(d[slot], abs=1e-9)
                    assert rows[link, i] < 0.6 or i == 0


def test_rows_of_one_link_differ_in_direction_or_place(robot):
    rng = np.random.default_rng(21)
    posture = robot.posture(robot.home)
    points = posture.T_base_link[3, :3, 3] + rng.normal(scale=0.3, size=(600, 3))
    _, many = found(robot, points, posture)
    several = 0
    for link in range(len(robot.links)):
        rows = [r for r in range(link * PAIRS, (link + 1) * PAIRS) if many.slot[r] >= 0]
        for n, a in enumerate(rows):
            for b in rows[:n]:
                apart = np.linalg.norm(many.on_robot[a] - many.on_robot[b])
                turn = np.degrees(np.arccos(np.clip(many.normal[a] @ many.normal[b], -1, 1)))
                assert apart > 0.08 or turn > 25.0
                several += 1
    assert several > 10


def foot_of(p, triangles):
    """The point of triangles (F, 3, 3) that is nearest to p, by planes, edges and nothing else."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    unit = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    flat = p - np.einsum("ij,ij->i", p - a, unit)[:, None] * unit
    inside = np.ones(len(a), dtype=bool)
    feet = [flat]
    for start, end in ((a, b), (b, c), (c, a)):
        edge = end - start
        inside &= np.einsum("ij,ij->i", np.cross(edge, flat - start), unit) >= 0.0
        length2 = np.maximum(np.einsum("ij,ij->i", edge, edge), 1e-300)
        t = np.clip(np.einsum("ij,ij->i", p - start, edge) / length2, 0.0, 1.0)
        feet.append(start + t[:, None] * edge)
    feet = np.stack(feet)
    d = np.linalg.norm(feet - p, axis=2)
    d[0, ~inside] = np.inf
    return feet.reshape(-1, 3)[d.argmin()]


def box_distance(local, body):
    """Of points (n, 3) of a link's frame to its box, 0 inside."""
    corners = body.vertices[np.unique(body.faces)]
    beyond = np.maximum(np.maximum(corners.min(axis=0) - local, local - corners.max(axis=0)), 0.0)
    return np.linalg.norm(beyond, axis=1)


def candidates(local, points, use, body, reach):
    """Rows whose voxels are nearest to a link's box, one a voxel, by the definition."""
    box = np.where(use, box_distance(local, body), np.inf)
    voxel = [tuple(v) for v in np.floor(points / VOXEL).astype(int)]
    best = {}
    for i in np.argsort(box, kind="stable"):
        if box[i] < reach:
            best.setdefault(voxel[i], i)
    return list(best.values()), voxel


def greedy(robot, link, points, use, posture, reach, first):
    """Distances that should be found for one link; brute force, by the definition."""
    T, body = posture.T_base_link[link], robot.bodies[link]
    local = (points - T[:3, 3]) @ T[:3, :3]
    near, voxel = candidates(local, points, use, body, reach)
    near = [first, *[i for i in near if voxel[i] != voxel[first]][: LOOKS - 1]]
    triangles, rows = body.vertices[body.faces], []
    for i in near:
        foot = foot_of(local[i], triangles)
        d = float(np.linalg.norm(local[i] - foot))
        if i == first or d < reach:
            rows.append((d, (foot - local[i]) / d, foot))
    taken = []
    for d, way, foot in sorted(rows, key=lambda r: r[0]):
        if all(np.linalg.norm(foot - f) > APART or way @ w < TURN for _, w, f in taken):
            taken.append((d, way, foot))
    return [d for d, _, _ in taken[:PAIRS]]


@pytest.mark.parametrize("reach", [0.3, 0.6])
@pytest.mark.parametrize("spread", [0.15, 0.4])
def test_the_rows_are_those_of_a_brute_force_by_the_definition(robot, reach, spread):
    rng = np.random.default_rng(23)
    several = 0
    for _ in range(3):
        posture = robot.posture(rng.uniform(-3, 3, robot.n))
        at = posture.T_base_link[3, :3, 3] + rng.normal(scale=0.3, size=3)
        points = at + rng.normal(scale=spread, size=(400, 3)) * [1.0, 1.0, 0.1]  # a slab
        use = rng.random(len(points)) < 0.8
        for link, body in enumerate(robot.bodies):  # signs are judged elsewhere
            T = posture.T_base_link[link]
            use &= box_distance((points - T[:3, 3]) @ T[:3, :3], body) > 0.0
        search = BodyPairs(robot)
        closest = search.search(points, use, posture)
        many = search.several(points, use, posture, closest, reach)
        for link in range(len(robot.links)):
            first = int(closest.slot[link])
            wanted = greedy(robot, link, points, use, posture, reach, first)
            found = many.distance[link * PAIRS : (link + 1) * PAIRS]
            found = found[np.isfinite(found)]
            assert found == pytest.approx(wanted, abs=1e-9)
            several += len(found) > 1
    assert several > 5


@settings(max_examples=25)
@given(seed=st.integers(0, 2**31), n=st.integers(1, 200))
def test_the_choice_does_not_depend_on_the_order_of_points_or_on_what_is_not_in_use(robot, seed, n):
    rng = np.random.default_rng(seed)
    posture = robot.posture(rng.uniform(-3, 3, robot.n))
    points = posture.T_base_link[3, :3, 3] + rng.normal(scale=0.4, size=(n, 3))
    _, one = found(robot, points, posture)
    order = rng.permutation(2 * n)
    shuffled = np.concatenate((points, rng.normal(scale=0.4, size=(n, 3))))[order]
    use = order < n
    search = BodyPairs(robot)
    closest = search.search(shuffled, use, posture)
    other = search.several(shuffled, use, posture, closest, 0.6)
    assert np.array_equal(one.distance, other.distance)


def test_links_take_turns_and_pairs_not_chosen_anew_are_held_and_measured_anew(robot):
    rng = np.random.default_rng(22)
    body = BodyPairs(robot)
    many = ManyPairs(body)
    q = robot.home.copy()
    points = robot.posture(q).T_base_link[3, :3, 3] + rng.normal(scale=0.3, size=(400, 3))
    use = np.ones(len(points), dtype=bool)

    def update(now):
        posture = robot.posture(q)
        closest = body.search(points, use, posture)
        return posture, closest, many.update(closest, points, use, posture, 0.6, now)

    links = len(robot.links)
    _, _, before = update(1.0)
    q += 0.02
    use[before.slot[3 * PAIRS + 1]] = False
    posture, closest, after = update(1.0 + RENEW / links)  # one link's turn: the first's
    fresh = body.several(points, use, posture, closest, 0.6)
    assert np.array_equal(after.slot[:PAIRS], fresh.slot[:PAIRS])
    assert np.array_equal(after.distance[::PAIRS], closest.distance)
    assert before.slot[3 * PAIRS + 1] >= 0 and after.slot[3 * PAIRS + 1] == -1
    followed = 0
    for link, shape in enumerate(robot.bodies):
        T = posture.T_base_link[link]
        d = signed_brute((points - T[:3, 3]) @ T[:3, :3], shape)
        for row in range(link * PAIRS, (link + 1) * PAIRS):
            if after.slot[row] >= 0:
                assert after.distance[row] == pytest.approx(d[after.slot[row]], abs=1e-9)
                arrow = after.on_robot[row] - points[after.slot[row]]
                assert arrow == pytest.approx(after.distance[row] * after.normal[row], abs=1e-9)
                followed += 1
                held = set(before.slot[link * PAIRS : (link + 1) * PAIRS]) | {closest.slot[link]}
                assert link == 0 or after.slot[row] in held
    assert followed > 15
    for turn in range(2, links + 1):  # when all have had theirs, all rows are a fresh choice
        again = update(1.0 + turn * RENEW / links)[2]
    assert np.array_equal(again.slot, fresh.slot)
    fewer = points[:20]  # the rows beyond are gone
    closest = body.search(fewer, use[:20], posture)
    left = many.update(closest, fewer, use[:20], posture, 0.6, 1.0 + 1.5 * RENEW)
    assert left.slot.max() < 20


def test_a_tick_as_long_as_the_period_or_a_step_back_in_time_chooses_for_all(robot):
    rng = np.random.default_rng(24)
    body = BodyPairs(robot)
    many = ManyPairs(body)
    posture = robot.posture(robot.home)
    for now in (1.0, 1.0 + RENEW, 0.5):
        points = posture.T_base_link[3, :3, 3] + rng.normal(scale=0.3, size=(200, 3))
        use = np.ones(len(points), dtype=bool)
        closest = body.search(points, use, posture)
        pairs = many.update(closest, points, use, posture, 0.6, now)
        assert np.array_equal(pairs.slot, body.several(points, use, posture, closest, 0.6).slot)


def test_two_threats_from_two_sides_are_both_found_before_a_neighbour_of_the_first(robot):
    posture = robot.posture(robot.home)
    middle = posture.T_base_link[3] @ np.array([-0.3, 0.0, 0.0393, 1.0])
    side = posture.T_base_link[3, :3, 1]
    points = np.stack([middle[:3] + s * side for s in (0.20, 0.21, -0.30)])
    _, many = found(robot, points, posture)
    assert many.slot[3 * PAIRS : 3 * PAIRS + 2].tolist() == [0, 2]


def test_no_points_give_no_rows(robot):
    _, many = found(robot, np.empty((0, 3)), robot.posture(robot.home))
    assert many.closest == -1 and (many.slot == -1).all() and np.isinf(many.distance).all()


def steady_slots(robot, hold, noise):
    """Slots of the forearm's pair before two points whose distances take turns to be less."""
    posture = robot.posture(robot.home)
    T = posture.T_base_link[3]
    base = np.stack([(T @ [x, 0.3, 0.0393, 1.0])[:3] for x in (-0.45, -0.2)])
    body = BodyPairs(robot)
    steady = HeldPairs(body)
    slots = []
    for i in range(20):
        points = base + T[:3, 1] * noise * np.array([[(-1.0) ** i], [0.0]])
        cloud = cloud_of(points)
        use = np.ones(2, dtype=bool)
        closest = body.update(cloud, posture)
        pairs = steady.update(closest, points, use, posture, hold)
        slots.append(int(pairs.slot[3]))
        assert pairs.distance[3] <= closest.distance[3] + hold
        assert pairs.on_world[3] == pytest.approx(points[pairs.slot[3]])
    return slots


def test_equals_do_not_make_the_control_point_jump(robot):
    assert len(set(steady_slots(robot, 0.0, 0.02))) == 2
    assert len(set(steady_slots(robot, 0.05, 0.02))) == 1


def test_a_point_that_is_nearer_by_more_than_the_margin_takes_over(robot):
    assert len(set(steady_slots(robot, 0.005, 0.03))) == 2
