"""Zones that see the arm's outline and the known cell at once, and a thing of the world there."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from app.cell.parts import Box, Cell
from app.judge.sampling import surface_points
from app.messages import Verdict, freeze
from app.perception.between import CORNERS, MARGIN, _spread
from app.perception.cloud import SkinCloud
from app.perception.rules import Rules
from tests.fakes import frame

FAR, AT = 3.0, 0.55  # [m]


def nearness(robot, skin, bend):
    """The posture with the elbow at `bend` [rad]; and of each sensor how near (64,) [m] its zones'
    rays come to the upper arm before `AT`."""
    q = robot.home.copy()
    q[2] = bend
    posture = robot.posture(q)
    upper = robot.link_index("upper_arm_link")
    body, T = robot.bodies[upper], posture.T_base_link[upper]
    surface = surface_points(body.vertices, body.faces, 0.01) @ T[:3, :3].T + T[:3, 3]
    tree = cKDTree(surface)
    for k in range(skin.count):
        T = posture.T_base_link[skin.link[k]]
        zones = slice(skin.first[k], skin.first[k + 1])
        lens, rays = T[:3, :3] @ skin.origin[k] + T[:3, 3], skin.reach[zones] @ T[:3, :3].T
        along = lens + np.arange(0.15, AT, 0.01)[:, None, None] * rays
        yield posture, k, tree.query(along)[0].min(axis=0)


@pytest.fixture(scope="module", name="stage")
def the_stage(robot, skin):
    """A posture, a sensor past whose view the upper arm's surface goes by hardly, and which zones
    (64,) have it nearer than a finger's width before `AT`."""
    for posture, k, near in nearness(robot, skin, 2.3):
        beside = ((near > 0.008) & (near < 0.02)).reshape(8, 8)
        clear = np.flatnonzero((near > 0.10).reshape(8, 8).all(axis=0))
        if beside[1:, 1:].any() and len(clear):
            return posture, k, beside, int(clear[0])
    raise AssertionError("no sensor sees past the upper arm")


def verdicts(robot, skin, stage, rows, wall, at=AT, rules=None):
    """Of the zones of a frame that reports `at` [m] in `rows` and nothing near elsewhere."""
    posture, k, *_ = stage
    T = posture.T_base_link[skin.link[k]]
    ahead = T[:3, :3] @ skin.axis[k]
    lens = T[:3, :3] @ skin.origin[k] + T[:3, 3]
    cell = Cell()
    if wall:
        T_base_box = np.eye(4)
        side = np.cross(ahead, [0.0, 0.0, 1.0])
        side /= np.linalg.norm(side)
        T_base_box[:3, :3] = np.column_stack([ahead, side, np.cross(ahead, side)])
        T_base_box[:3, 3] = lens + (at + 0.25 + 0.5) * ahead
        cell = Cell(boxes=(Box("wall", freeze(T_base_box), freeze(np.array([1.0, 4.0, 4.0]))),))
    cloud = SkinCloud(robot, skin, cell)
    z = np.full(64, FAR)
    z[list(rows)] = at
    for i in range(2):
        shown = replace(frame(k, 0.0667 * i, z))
        cloud.add_frames([shown], posture, rules or Rules(doubts_windows=False))
    first = skin.first[k]
    return cloud.newest().verdict[first : first + 64]


def test_one_zone_between_the_outline_and_the_known_cell_is_both_of_them(robot, skin, stage):
    beside = np.flatnonzero(stage[2])
    without = Rules(doubts_windows=False, doubts_mixtures=False)
    taken = believed = 0
    for zone in beside:
        taken += verdicts(robot, skin, stage, [zone], wall=True)[zone] == Verdict.STATIC
        believed += verdicts(robot, skin, stage, [zone], True, rules=without)[zone] == Verdict.KEPT
        assert verdicts(robot, skin, stage, [zone], wall=False)[zone] != Verdict.STATIC
    assert believed > 0 and taken == believed


def test_a_thing_two_zones_wide_both_ways_is_kept_before_the_known_cell(robot, skin, stage):
    zone = next(z for z in np.flatnonzero(stage[2]) if z >= 9 and z % 8)
    rows = [zone - 9, zone - 8, zone - 1, zone]
    found = verdicts(robot, skin, stage, rows, wall=True)
    assert not (found == Verdict.STATIC)[rows].any()


def test_a_thin_thing_clear_of_the_arm_is_kept_before_the_known_cell(robot, skin, stage):
    column = [row * 8 + stage[3] for row in range(8)]  # a hand's breadth from the arm
    alone, found = (verdicts(robot, skin, stage, column, wall=w) for w in (False, True))
    assert (alone[column] == Verdict.KEPT).sum() >= 3
    assert (found[column] == alone[column]).all()


def test_the_rays_round_a_zone_go_to_its_corners_from_beside_its_point():
    rng = np.random.default_rng(1)
    rays, points = rng.normal(size=(2, 40, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    away, half = rng.uniform(0.1, 1.0, 40), rng.uniform(0.02, 0.1, 40)
    begin, spread = (a.reshape(40, 5, 3) for a in _spread(rays, away, points, half))
    across = np.cross(rays, np.eye(3)[np.argmin(np.abs(rays), axis=1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    sides = CORNERS @ np.stack([across, np.cross(rays, across)], axis=1)
    aside = sides * half[:, None, None]
    assert np.array_equal(spread, rays[:, None] + aside)
    expected = points[:, None] + away[:, None, None] * aside + MARGIN * sides
    assert np.array_equal(begin, expected)


def test_a_row_longer_than_three_zones_is_a_mixture_where_it_passes_the_arm(robot, skin):
    """As a hose makes it; a hand's breadth from the arm such a row is kept, see above."""
    taken = 0
    for bend in (2.1, 2.3, 2.5):
        for posture, k, near in nearness(robot, skin, bend):
            past = ((near > 0.008) & (near < 0.025)).reshape(8, 8)
            column = int(past.sum(axis=0).argmax())
            line = np.flatnonzero(past[:, column]) * 8 + column
            if len(line) < 4 or line[-1] - line[0] != 8 * (len(line) - 1):
                continue
            found = [verdicts(robot, skin, (posture, k), line, wall=w) for w in (True, False)]
            assert not (found[1][line] == Verdict.STATIC).any()
            taken = max(taken, int((found[0][line] == Verdict.STATIC).sum()))
    assert taken > 3
