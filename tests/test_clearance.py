"""How far the arm is from the cell, judged by brute force, and what bounds it there."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.cell.learned import EDGE, NOTHING_LEARNED, Learned, cubes_at
from app.cell.parts import LEARNED, Box, Cell, HalfSpace
from app.config import Params
from app.control.beginning import warnings
from app.control.bounds.cell import CellBounds
from app.control.bounds.gap_rows import LEVER, MOST
from app.control.cell_gaps import BESIDE, always_in, cell_within
from app.control.clearance import Clearance
from app.control.cubes import make_cubes, nearest_cube
from app.control.segments import to_box
from app.messages import Pairs
from app.poses import transform
from app.robot.model import find_robot, load_robot
from app.robot.tables import Choice
from app.world.scene import find_scene, load_scene
from tests.alone import bound_by

DENSE = np.linspace(0.0, 1.0, 1001)[:, None]  # places on a segment
NOTHING = Pairs(
    np.empty(0, np.intp), np.empty(0), *np.empty((3, 0, 3)), np.empty(0, np.intp), -1
)  # fmt: skip
number = st.floats(-1.0, 1.0)
place = st.tuples(number, number, number).map(np.array)
cube = st.tuples(*(st.integers(-6, 6),) * 3)


def solid(centre, rpy, size):
    return Box("box", transform(np.array(centre), np.array(rpy)), np.array(size))


def plane_at(z, size=(2.0, 2.0), rpy=(0.0, 0.0, 0.0)):
    return HalfSpace("floor", transform(np.array([0.0, 0.0, z]), np.array(rpy)), np.array(size))


def wall(x, y, z):
    """Cubes whose centres lie in ranges (low, high) [m] of x, y, z."""
    axes = [np.arange(round(low / EDGE), round(high / EDGE)) for low, high in (x, y, z)]
    return Learned.of(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3))


def outside(points, half):
    """Distance (n,) of points (n, 3) to a box around the origin, negative inside."""
    over = np.abs(points) - half
    far = np.linalg.norm(np.maximum(over, 0.0), axis=1)
    return np.where(far > 0.0, far, over.max(axis=1))


def axes(clearance, posture):
    """Every capsule's axis (Q, 2, 3), base frame, and its radius (Q,)."""
    body = clearance.pieces
    T = posture.T_base_link[body.link]
    ends = np.einsum("cij,cej->cei", T[:, :3, :3], body.ends) + T[:, None, :3, 3]
    return ends, body.radius


# --- the kernels against brute force ------------------------------------------------------


@given(place, place, st.tuples(*(st.floats(0.01, 0.7),) * 3).map(np.array))
@settings(max_examples=300)
def test_the_nearest_place_of_a_segment_to_a_box_is_that_of_a_dense_search(a, b, half):
    s, square = to_box(a, b - a, half)
    dense = np.maximum(outside(a + DENSE * (b - a), half), 0.0).min()
    assert 0.0 <= s <= 1.0
    assert np.sqrt(square) == pytest.approx(dense, abs=1e-3)
    assert np.sqrt(square) <= dense + 1e-9


@given(st.lists(cube, min_size=1, max_size=60), place, place, st.floats(0.05, 1.5))
@settings(max_examples=300)
def test_the_nearest_learned_cube_is_that_of_a_dense_search(cubes, a, b, within):
    a, b = 0.6 * a, 0.6 * b
    learned = Learned.of(np.array(cubes))
    on_axis, on_cube = np.empty(3), np.empty(3)
    found = nearest_cube(a, b, within, make_cubes(learned), on_axis, on_cube)
    line, half = a + DENSE * (b - a), np.full(3, EDGE / 2)
    least = min(outside(line - c, half).min() for c in learned.centres())
    if least > 1e-3:
        if abs(least - within) > 1e-3:
            assert (found < np.inf) == (least < within)
        if found < np.inf:
            assert found == pytest.approx(least, abs=1e-3)
            assert np.linalg.norm(on_axis - on_cube) == pytest.approx(found, abs=1e-9)
    elif least < -1e-3:  # it goes in: the depth is that to a face that leads out
        assert -EDGE <= found < 0.0


def test_the_way_out_of_a_learned_wall_is_not_along_it():
    post = make_cubes(wall((0.0, 0.05), (0.0, 0.05), (-1.0, 1.0)))
    on_axis, on_cube = np.empty(3), np.empty(3)
    a, b = np.array([-0.3, 0.012, 0.048]), np.array([0.3, 0.012, 0.048])  # near to a cube's end
    assert nearest_cube(a, b, 0.1, post, on_axis, on_cube) < 0.0
    assert abs(on_cube - on_axis)[2] == pytest.approx(0.0, abs=1e-9)
    assert on_cube[1] == pytest.approx(0.0)


@given(st.integers(0, 2**31))
@settings(max_examples=15)
def test_the_gaps_to_the_cell_are_those_of_a_dense_search(robot, seed):
    rng = np.random.default_rng(seed)
    cell = Cell(
        boxes=tuple(
            replace(solid(*rng.uniform(-1, 1, (2, 3)), rng.uniform(0.02, 1.0, 3)), name=f"b{i}")
            for i in range(3)
        ),
        planes=(plane_at(-0.3, rpy=rng.uniform(-0.5, 0.5, 3)),),
        learned=Learned.of(rng.integers(-20, 20, (40, 3))),
    )
    clearance = Clearance(robot, cell)
    posture = robot.posture(rng.uniform(-np.pi, np.pi, 6))
    gaps = clearance.measure(posture, 0.3)
    ends, radius = axes(clearance, posture)
    line = ends[:, :1] + DENSE * (ends[:, 1:] - ends[:, :1])
    row = {int(p): i for i, p in enumerate(gaps.pair)}
    assert set(clearance.cell_cases[:, 1]) == {0, 1, 2, 3, 4}
    for k, (q, part) in enumerate(clearance.cell_cases):
        if part < 3:
            box = cell.boxes[part]
            T = np.linalg.inv(box.T_base_box)
            d = outside(line[q] @ T[:3, :3].T + T[:3, 3], box.size / 2).min()
        elif part == 3:
            T = np.linalg.inv(cell.planes[0].T_base_plane)
            d = (line[q] @ T[2, :3] + T[2, 3]).min()
        else:
            half = np.full(3, EDGE / 2)
            d = min(outside(line[q] - c, half).min() for c in cell.learned.centres())
            if d < 0.0:
                continue  # the depth is that to a face that leads out
        more = BESIDE if part == 4 else 0.0
        i = row.get(len(clearance.pairs) + k)
        check(gaps, i, d - radius[q] - more, 0.3, more)


def check(gaps, row, distance, within, more):
    if row is None:
        assert distance > within - 1e-3
        return
    assert gaps.distance[row] == pytest.approx(distance, abs=1e-3)
    apart = (gaps.on_a[row] - gaps.on_b[row]) @ gaps.normal[row]
    assert apart == pytest.approx(gaps.distance[row] + more, abs=1e-9)
    assert np.linalg.norm(gaps.normal[row]) == pytest.approx(1.0)


def test_a_normal_is_the_rate_of_its_distance(robot):
    cell = Cell(
        boxes=(solid([0.7, 0.2, 0.5], [0.3, 0.2, 0.1], [0.2, 0.3, 0.4]),),
        planes=(plane_at(0.2, rpy=(0.1, -0.2, 0.0)),),
        learned=wall((-0.6, -0.55), (-0.5, 0.5), (0.3, 0.9)),
    )
    clearance, q = Clearance(robot, cell), robot.home + np.array([0.1, 0.1, -0.2, 0.2, 0.1, 0.0])
    here = clearance.measure(robot.posture(q), 1.0)
    posture = robot.posture(q)
    dq = 1e-6 * np.random.default_rng(5).normal(size=6)
    there = clearance.measure(robot.posture(q + dq), 1.0)
    cell_rows = (here.b < 0) & (here.distance > 0.01)
    assert set(here.part[cell_rows]) == {0, 1, 2}
    for i in np.flatnonzero(cell_rows):
        (j,) = np.flatnonzero(there.pair == here.pair[i])
        J = posture.distance_rows(
            here.a[i : i + 1].astype(np.intp), here.on_a[i : i + 1], here.normal[i : i + 1]
        )[0]
        assert there.distance[j] - here.distance[i] == pytest.approx(J @ dq, abs=2e-9)


# --- what is measured, and what is not ----------------------------------------------------


def test_what_is_measured_does_not_depend_on_the_posture_the_arm_begins_in():
    """Taught near the table, the wrist is a pair with it as from any other posture."""
    low = Choice(home_deg=(0.0, -60.0, 130.0, -160.0, -90.0, 0.0))
    usual, taught = (load_robot(find_robot("ur10e"), c) for c in (Choice(), low))
    wrist = taught.posture(taught.home).T_base_link[-1, :3, 3]
    cell = Cell(boxes=(solid(wrist - [0.0, 0.0, 0.08], [0, 0, 0], [0.3, 0.3, 0.1]),))
    gaps = Clearance(taught, cell).measure(taught.posture(taught.home), 0.025)
    assert taught.links.index("wrist_3_link") in gaps.a[gaps.b < 0]
    one, two = (Clearance(r, cell) for r in (usual, taught))
    np.testing.assert_array_equal(one.pairs, two.pairs)
    np.testing.assert_array_equal(one.cell_cases, two.cell_cases)


def test_what_stands_in_the_table_in_every_posture_is_no_pair_and_the_rest_of_its_link_is(robot):
    cell = load_scene(find_scene("empty")).cell
    clearance = Clearance(robot, cell)
    body, pedestal = clearance.pieces, cell.names.index("pedestal")
    pieces = clearance.cell_cases[clearance.cell_cases[:, 1] == pedestal, 0]
    upper_arm = np.flatnonzero(body.link == robot.links.index("upper_arm_link"))
    assert 0 < np.isin(upper_arm, pieces).sum() < len(upper_arm)
    shoulder = np.flatnonzero(body.link == robot.links.index("shoulder_link"))
    assert not np.isin(shoulder, pieces).any()


def test_learned_cubes_that_a_link_can_never_leave_hide_no_others(robot):
    """The shoulder stands in what was learned of the table; the wrist is still kept from it."""
    table = wall((-0.5, 0.5), (-0.5, 0.5), (-0.05, 0.1))
    clearance = Clearance(robot, Cell(learned=table))
    links = clearance.pieces.link[clearance.cell_cases[:, 0]]
    assert robot.links.index("shoulder_link") not in links
    assert robot.links.index("wrist_3_link") in links
    clearance.know(NOTHING_LEARNED)
    assert clearance.measure(robot.posture(robot.home), 9.0).part.max() == -1
    clearance.know(Learned.of(np.array([[20, 0, 0]])))
    assert set(clearance.measure(robot.posture(robot.home), 9.0).a) >= set(range(1, 8))


def test_learning_at_run_time_compiles_nothing(robot):
    clearance, posture = Clearance(robot), robot.posture(robot.home)
    clearance.measure(posture, 0.15)
    before = [len(f.signatures) for f in (cell_within, always_in)]
    for learned in (wall((0.5, 0.6), (-1, 1), (0, 1)), Learned.of(np.array([[9, 9, 9]]))):
        clearance.know(learned)
        clearance.measure(posture, 0.15)
    assert [len(f.signatures) for f in (cell_within, always_in)] == before


def test_a_gap_that_no_joint_can_change_is_no_bound_and_takes_no_place_of_one(robot):
    """Many boxes are nearer to the turning shoulder than one below the wrist is to the wrist."""
    foot = [
        replace(solid([x, y, 0.04], [0, 0, 0], [0.01, 0.01, 0.04]), name=f"{x} {y}")
        for x in (-0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03)
        for y in (-0.02, -0.01, 0.0, 0.01, 0.02)
    ]
    posture, wrist = robot.posture(robot.home), len(robot.links) - 1
    at = posture.T_base_link[wrist, :3, 3]
    under = solid(at - [0, 0, 0.08], [0, 0, 0], [0.2, 0.2, 0.1])
    clearance = Clearance(robot, Cell(boxes=(*foot, under)))
    rows = bound_by(robot, CellBounds(clearance), posture, NOTHING, Params())
    gaps = clearance.measure(posture, 0.15)
    assert (np.sort(gaps.distance)[:MOST] < gaps.distance[gaps.a == wrist].min()).all()
    lift = posture.distance_rows(np.array([wrist]), at[None].copy(), np.array([[0.0, 0.0, 1.0]]))[0]
    assert (np.abs(rows.jacobian - lift).max(axis=1) < 0.1).any()
    assert (np.abs(rows.jacobian).sum(axis=1) > LEVER).all()


def test_a_person_is_told_how_near_the_arm_begins(robot):
    T = robot.posture(robot.home).T_base_link
    i = robot.links.index("wrist_3_link")
    gaps = Clearance(robot, Cell(planes=(plane_at(-9.0),))).measure(robot.posture(robot.home), 99.0)
    low = gaps.distance[gaps.a == i].min() - 9.0
    assert T[i, 2, 3] > low
    cell = Cell(planes=(plane_at(low - 0.008),))
    assert warnings(robot, cell) == ("wrist_3 begins 0.8 cm from 'floor'",)
    (line, *_) = warnings(robot, Cell(planes=(plane_at(low + 0.02),)))
    assert line == "wrist_3 begins 2.0 cm inside 'floor'; it moves away first"
    assert warnings(robot, Cell()) == ()
    for scene in ("cell", "empty"):
        assert warnings(robot, load_scene(find_scene(scene)).cell) == ()
    inside = Learned.of(cubes_at(T[i : i + 1, :3, 3]))
    assert LEARNED in warnings(robot, Cell(learned=inside))[0]
