"""Planes and the learned background: the still cell goes, a person before it stays."""

import numpy as np
import pytest

from app.cell.learned import EDGE, Learned, cubes_at
from app.cell.parts import Cell, HalfSpace
from app.errors import SensorError
from app.messages import Verdict
from app.perception.background import Background
from app.perception.cloud import SkinCloud
from app.perception.rules import Rules
from app.perception.static_filter import StaticFilter
from app.sensing.simulated import SimulatedSkin
from app.world.scene import load_scene
from app.world.world import World
from tests.fakes import frame

P = Rules()
WALL = np.array([[1.0, 0.0, 0.0], [1.0, 0.3, 0.0]])


def kept(robot, skin, eye, cloud, begin, seconds):
    """Kept points of the last 0.2 s, (n, 3) base frame."""
    posture = robot.posture(robot.home)
    for i in range(round(seconds * 75)):
        t = begin + i / 75
        for f in eye.poll(t, posture):
            cloud.add_frames([f], posture, P)
        cloud.background.finish(t)
    return cloud.view(t).kept()


def learn(background, points, begin=0.0, seconds=1.0):
    """Learn from frames of the same points (n, 3)."""
    background.learn(begin, seconds)
    for i in range(round(15 * seconds)):
        background.count_points(points, begin + i / 15)
    assert background.finish(begin + seconds)


def test_a_person_at_a_learned_wall_is_still_kept(robot, skin):
    world = World(())
    world.add("wall", {"kind": "box", "size_m": [3.0, 0.05, 3.0]}, (0.3, 1.0, 0.5))
    eye, cloud = SimulatedSkin(robot, skin, world, 1), SkinCloud(robot, skin, Cell())
    assert len(kept(robot, skin, eye, cloud, 0.0, 1.0)) > 100
    cloud.background.learn(1.0, 3.0)
    assert len(kept(robot, skin, eye, cloud, 1.0, 3.1)) > 100  # a preview changes nothing
    assert not cloud.background.learning and len(cloud.background.preview) > 50
    cloud.background.keep()
    cloud.static_filter.know(cloud.background.known)
    assert len(kept(robot, skin, eye, cloud, 4.1, 1.0)) < 5
    world.add("person", {"kind": "capsule", "radius_m": 0.13, "length_m": 1.2}, (0.35, 0.84, 0.4))
    seen = kept(robot, skin, eye, cloud, 5.1, 1.0)
    assert len(seen) > 10
    assert (seen[:, 1] < 0.90).mean() > 0.9  # the person, not the wall at 0.975


def test_who_walks_through_while_learning_is_not_learned():
    background = Background()
    background.learn(0.0, 2.0)
    for i in range(30):
        walker = np.array([[0.5, 0.03 * i, 0.0]])
        background.count_points(np.concatenate((WALL, walker)), i / 15)
    assert not background.finish(1.9)
    assert background.finish(2.0) and not background.finish(2.1)
    assert np.array_equal(background.preview.cells, cubes_at(WALL))


def test_nothing_is_known_before_a_person_keeps_it():
    background = Background()
    learn(background, WALL)
    assert len(background.known) == 0 and len(background.preview) == 2
    background.discard()
    assert len(background.preview) == 0
    with pytest.raises(SensorError, match="learn it first"):
        background.keep()


def test_what_was_known_stays_in_force_while_more_is_learned_and_more_is_added_to_it():
    before = Learned.of(cubes_at(np.array([[0.0, 2.0, 0.0]])))
    background = Background(before)
    background.learn(0.0, 1.0)
    assert background.known is before
    learn(background, WALL)
    background.keep()
    assert {tuple(c) for c in background.known.cells} == {(0, 40, 0), (20, 0, 0), (20, 5, 0)}
    background.learn(2.0, 1.0)
    background.discard()
    assert not background.learning and len(background.known) == 3


def test_forgetting_clears_all_and_ends_a_learning():
    background = Background(Learned.of(cubes_at(WALL)))
    background.learn(0.0, 1.0)
    background.forget()
    assert not background.learning and len(background.known) == 0
    assert len(background.view(0.5).known) == 0


def test_onlookers_get_the_same_arrays_until_something_changes():
    background = Background(Learned.of(cubes_at(WALL)))
    one, two = background.view(0.0), background.view(1.0)
    assert one.known is two.known and one.preview is two.preview and one.left == 0.0
    np.testing.assert_allclose(one.known, (cubes_at(WALL) + 0.5) * EDGE)
    background.learn(1.0, 3.0)
    assert background.view(1.5).left == pytest.approx(2.5)
    learn(background, WALL + 1.0, 2.0)
    assert len(background.view(9.0).preview) == 2 and background.view(9.0).known is one.known


@pytest.mark.parametrize("seconds", [0.0, -1.0, 1e9, float("nan"), "3", None])
def test_a_time_that_makes_no_sense_is_refused(seconds):
    with pytest.raises(SensorError, match="cannot learn for"):
        Background().learn(0.0, seconds)


def test_points_in_and_beside_learned_cubes_are_static_and_two_cubes_away_are_not():
    walls = StaticFilter(Cell(learned=Learned.of(np.array([[2, 3, 4]]))))
    middle = (np.array([2, 3, 4]) + 0.5) * EDGE
    steps = np.array([[0, 0, 0], [1, -1, 1], [0, 0, 2], [-2, 0, 0], [np.nan, 0, 0]]) * EDGE
    assert walls.inside(middle + steps).tolist() == [True, True, False, False, False]
    walls.know(Learned.of(np.empty((0, 3), dtype=np.int64)))
    assert not walls.inside(middle + steps).any()


def test_all_below_a_plane_is_static_and_what_is_above_is_not(tmp_path):
    tilted = np.eye(4)
    tilted[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # its z axis is the base's y axis
    tilted[:3, 3] = [0.0, -1.0, 0.0]
    planes = StaticFilter(Cell(planes=(HalfSpace("wall", tilted, np.ones(2)),)))
    points = np.array([[0.0, -1.2, 0.0], [0.0, -0.8, 5.0], [np.nan, -2.0, 0.0]])
    assert planes.inside(points).tolist() == [True, False, False]
    file = tmp_path / "s.toml"
    file.write_text('title = "t"\n[[plane]]\nname = "ground"\nposition_m = [0.0, 0.0, -0.7]\n')
    cell = load_scene(file).cell
    assert [p.name for p in cell.planes] == ["ground"] and cell.boxes == ()
    far = np.array([[9.0, 9.0, -0.71], [0, 0, -0.69]])
    assert StaticFilter(cell).inside(far).tolist() == [True, False]


def test_static_points_of_the_background_have_their_verdict(robot, skin):
    cloud = SkinCloud(robot, skin, Cell())
    posture = robot.posture(robot.home)
    cloud.background.learn(0.0, 1.0)
    for i in range(16):
        cloud.add_frames([frame(15, i / 15, 1.5)], posture, P)
    cloud.background.finish(1.1)
    cloud.add_frames([frame(15, 1.2, 1.5)], posture, P)
    assert set(cloud.view(1.2).verdict[64 * 15 : 64 * 16]) == {Verdict.KEPT}
    cloud.background.keep()
    cloud.static_filter.know(cloud.background.known)
    cloud.add_frames([frame(15, 1.3, 1.5)], posture, P)
    assert set(cloud.view(1.3).verdict[64 * 15 : 64 * 16]) == {Verdict.STATIC}
