"""Each verdict in words: what a zone saw, why it was believed or not, and what would change it."""

from dataclasses import replace

import numpy as np
import pytest

from app.cell.parts import Box, Cell, HalfSpace
from app.messages import Cloud, Verdict
from app.perception.uncertainty import known_of, threshold
from app.ui.picking import pick_point, pick_sensor
from app.ui.verdicts import Zone, distances, explain, mounting_for, part_at, title

CELL = Cell(
    boxes=(Box("table", np.eye(4), np.array([1.0, 1.0, 0.1])),),
    planes=(HalfSpace("floor", np.eye(4), np.array([2.0, 2.0])),),
)


@pytest.fixture
def zone(robot, skin):
    """Make a zone of sensor 17, row 3, column 5."""

    def make(verdict, gap=np.inf, link="", distance=0.31, point=(1.0, 0.0, 0.5), **more):
        S = skin.slots
        slot = int(skin.first[17]) + 2 * 8 + 4
        points, rows = np.full((S, 3), np.nan), np.full(S, np.inf)
        points[slot], rows[slot] = point, gap
        eps = np.full(S, threshold(known_of(skin), 17, distance, 0.0))
        links = np.full(S, robot.link_index(link) if link else -1, dtype=np.int16)
        verdicts = np.full(S, int(verdict), dtype=np.uint8)
        cloud = Cloud(points, verdicts, links, rows, eps, np.zeros(skin.count))
        return Zone(
            cloud, slot, 17, distance, more.get("age", 0.02), more.get("dirty", False), skin,
            robot, CELL,
        )  # fmt: skip

    return make


def test_a_zone_is_called_by_sensor_row_column_and_distance(zone, skin):
    assert title(zone(Verdict.KEPT)) == f"{skin.sensors[17].name}, row 3, column 5: 31.0 cm"
    assert title(zone(Verdict.NO_TARGET, distance=np.nan)).endswith("no distance")


def test_a_hit_of_the_arm_says_where_how_near_and_what_a_better_mounting_would_do(zone):
    z = zone(Verdict.SELF, gap=0.003, link="upper_arm_link")
    words = explain(z)
    assert words.said == (
        "The arm itself: it hit the upper arm 3 mm before the mesh, the threshold is "
        f"{1000 * z.eps:.0f} mm."
    )
    assert words.change.startswith(f"{1000 * (z.eps - 0.003):.0f} mm nearer to the lens it would")
    assert "If the mounting is off by 3 mm, it may be an obstacle today." in words.change
    assert "No better mounting alone" in words.change  # noise alone explains 3 mm
    assert words.short == "the arm itself: the upper arm, 3 mm before its mesh"
    behind = explain(zone(Verdict.SELF, gap=-0.004, link="upper_arm_link"))
    assert "4 mm behind the mesh" in behind.said and "mounting" not in behind.change


def test_the_mounting_error_that_would_change_a_verdict_gives_that_threshold(zone, robot, skin):
    z = zone(Verdict.KEPT, gap=0.05, link="upper_arm_link")
    sigma = mounting_for(z, z.gap)
    position = skin.doubt.position.copy()
    position[17] = sigma
    worse = replace(skin, doubt=replace(skin.doubt, position=position))
    assert threshold(known_of(worse), 17, z.distance, 0.0) == pytest.approx(z.gap, abs=1e-9)
    assert f"known to {1000 * sigma:.0f} mm only; now it is known to 2 mm" in explain(z).change
    measured = replace(z, robot=replace(robot, eps=np.full((len(robot.links), 2), 0.01)))
    assert np.isnan(mounting_for(measured, z.gap))
    hit = replace(zone(Verdict.SELF, gap=0.003, link="upper_arm_link"), robot=measured.robot)
    assert "threshold was measured" in explain(hit).change


@pytest.mark.parametrize(
    ("verdict", "facts", "said", "change"),
    [
        (Verdict.KEPT, {}, "no part of the arm is in this zone's way", "learn the background"),
        (Verdict.KEPT, {"gap": 0.062, "link": "forearm_link"},
         "An obstacle: 62 mm before the forearm", "farther away it would count as the arm"),
        (Verdict.KEPT, {"gap": -0.062, "link": "forearm_link"}, "published rules", "`paper`"),
        (Verdict.SELF, {"gap": 0.5, "link": "forearm_link"},
         "a hose or a cable on the forearm", "Wider than 7 cm"),
        (Verdict.SELF, {"gap": 0.5, "link": "forearm_link", "dirty": True},
         "the window is dirty", "Clean the window"),
        (Verdict.BEHIND, {"gap": -0.04, "link": "forearm_link"},
         "40 mm behind the surface of the forearm", "flinch calibrate mounts"),
        (Verdict.STATIC, {"point": (0.2, 0.1, 0.03)}, "20 mm inside 'table'", "cell file"),
        (Verdict.STATIC, {"point": (2.0, 0.1, -0.05)}, "50 mm inside 'floor'", "cell file"),
        (Verdict.STATIC, {}, "learned background", "Forget the background"),
        (Verdict.BAD_STATUS, {}, "its status is none of 5", "Sunlight"),
        (Verdict.NO_TARGET, {"distance": np.nan}, "Nothing came back", "A grey thing is found"),
        (Verdict.OUT_OF_RANGE, {"distance": 0.001}, "nearer than the 2 cm", "type's file"),
        (Verdict.OUT_OF_RANGE, {"distance": 9.0}, "farther than the 400 cm", "type's file"),
        (Verdict.STALE, {"age": 1.4}, "1.4 s old, and counts for 0.2 s", "next frame"),
        (Verdict.EMPTY, {"distance": np.nan}, "No frame has come", "first frame"),
        (Verdict.GHOST, {}, "one zone has seen it in one frame", "makes it an obstacle"),
        (Verdict.CONTACT, {}, "nearer than can be measured", "seen to leave"),
    ],
)  # fmt: skip
def test_every_verdict_says_why_and_what_would_change_it(zone, verdict, facts, said, change):
    words = explain(zone(verdict, **facts))
    assert said in words.said and change in words.change
    assert 0 < len(words.short) < 60


def test_a_point_is_nowhere_in_a_cell_that_does_not_hold_it():
    assert part_at(CELL, np.array([0.0, 0.0, 0.2])) == ("", 0.0)
    assert part_at(Cell(), np.zeros(3)) == ("", 0.0)


def test_distances_are_what_the_sensors_reported(robot, skin):
    posture = robot.posture(robot.home)
    T = posture.T_base_link[skin.link]
    lens = T[:, :3, 3] + np.einsum("kij,kj->ki", T[:, :3, :3], skin.origin)
    rays = np.einsum("sij,sj->si", T[skin.sensor_of][:, :3, :3], skin.reach)
    points = lens[skin.sensor_of] + 0.4 * rays
    points[5] = np.nan
    none = np.zeros(skin.slots)
    cloud = Cloud(
        points, none.astype(np.uint8), none.astype(np.int16), none, none, np.zeros(skin.count)
    )
    far = distances(cloud, posture.T_base_link, skin)
    assert np.isnan(far[5]) and np.delete(far, 5) == pytest.approx(0.4)


def test_a_click_takes_the_point_nearest_to_its_ray_that_is_shown():
    eye, ahead = np.zeros(3), np.array([2.0, 0.0, 0.0])
    points = np.array([[1.0, 0.005, 0.0], [2.0, 0.002, 0.0], [-1.0, 0.0, 0.0], [np.nan] * 3])
    everything = np.ones(4, dtype=bool)
    assert pick_point(eye, ahead, points, everything)[0] == 1
    assert pick_point(eye, ahead, points, np.array([True, False, True, True]))[0] == 0
    assert pick_point(eye, np.array([0.0, 0.0, 1.0]), points, everything) == (-1, np.inf)
    assert pick_point(eye, ahead, np.empty((0, 3)), np.empty(0, dtype=bool))[0] == -1


def test_a_click_takes_the_cone_that_looks_at_the_eye_and_none_that_looks_away(robot, skin):
    posture = robot.posture(robot.home)
    T = posture.T_base_link[skin.link[17]]
    axis = T[:3, :3] @ skin.axis[17]
    lens = T[:3, 3] + T[:3, :3] @ skin.origin[17]
    eye = lens + 1.5 * axis
    assert pick_sensor(eye, lens - eye, posture.T_base_link, skin)[0] == 17
    k, _ = pick_sensor(lens - 1.5 * axis, axis, posture.T_base_link, skin)
    assert k != 17
    assert pick_sensor(eye, axis, posture.T_base_link, skin) == (-1, np.inf)
