"""Planes and the learned background: the still cell goes, a person before it stays."""

import numpy as np
import pytest

from app.config import Params
from app.errors import SensorError
from app.messages import CropBox, Verdict
from app.perception.background import Background
from app.perception.cloud import SkinCloud
from app.perception.static_filter import StaticFilter
from app.sensing.simulated import SimulatedSkin
from app.world.scene import load_scene
from app.world.world import World

P = Params()


def kept(robot, skin, eye, cloud, begin, seconds):
    """Kept points of the last 0.2 s, (n, 3) base frame."""
    posture = robot.posture(robot.home)
    for i in range(round(seconds * 75)):
        t = begin + i / 75
        for f in eye.poll(t, posture):
            cloud.take([f], posture, P)
        cloud.background.finish(t)
    return cloud.view(t, P).kept()


def test_a_person_at_a_learned_wall_is_still_kept(robot, skin):
    world = World(())
    world.add("wall", {"kind": "box", "size_m": [3.0, 0.05, 3.0]}, (0.3, 1.0, 0.5))
    eye, cloud = SimulatedSkin(robot, skin, world, 1), SkinCloud(robot, skin, ())
    assert len(kept(robot, skin, eye, cloud, 0.0, 1.0)) > 100
    cloud.background.learn(1.0, 3.0)
    kept(robot, skin, eye, cloud, 1.0, 3.1)
    assert not cloud.background.learning and len(cloud.background.cells) > 50
    assert len(kept(robot, skin, eye, cloud, 4.1, 1.0)) < 5
    world.add("person", {"kind": "capsule", "radius_m": 0.13, "length_m": 1.2}, (0.35, 0.84, 0.4))
    seen = kept(robot, skin, eye, cloud, 5.1, 1.0)
    assert len(seen) > 10
    assert (seen[:, 1] < 0.90).mean() > 0.9  # the person, not the wall at 0.975


def test_who_walks_through_while_learning_is_not_learned():
    background = Background()
    background.learn(0.0, 2.0)
    wall = np.array([[1.0, 0.0, 0.0], [1.0, 0.3, 0.0]])
    for i in range(30):
        walker = np.array([[0.5, 0.03 * i, 0.0]])
        background.take(np.concatenate((wall, walker)), i / 15)
    assert background.finish(2.0) and not background.finish(2.1)
    assert background.inside(wall + 0.02).all()
    assert not background.inside(np.array([[0.5, 0.45, 0.0], [np.nan, 0.0, 0.0]])).any()


def test_a_background_survives_its_file(tmp_path):
    background, other = Background(), Background()
    background.learn(0.0, 1.0)
    for i in range(15):
        background.take(np.array([[1.0, -0.2, 0.3]]), i / 15)
    background.finish(1.0)
    background.save(tmp_path / "b.txt")
    other.load(tmp_path / "b.txt")
    assert other.inside(np.array([[1.0, -0.2, 0.3]])).all()
    (tmp_path / "c.txt").write_text("no numbers")
    with pytest.raises(SensorError, match="learn it anew"):
        other.load(tmp_path / "c.txt")


def test_all_below_a_plane_is_static_and_what_is_above_is_not(tmp_path):
    tilted = np.eye(4)
    tilted[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # its z axis is the base's y axis
    tilted[:3, 3] = [0.0, -1.0, 0.0]
    planes = StaticFilter([CropBox("wall", tilted, np.ones(3), plane=True)])
    points = np.array([[0.0, -1.2, 0.0], [0.0, -0.8, 5.0], [np.nan, -2.0, 0.0]])
    assert planes.inside(points).tolist() == [True, False, False]
    file = tmp_path / "s.toml"
    file.write_text('title = "t"\n[[plane]]\nname = "ground"\nposition_m = [0.0, 0.0, -0.7]\n')
    (crop,) = load_scene(file).crops
    assert crop.plane
    assert StaticFilter([crop]).inside(np.array([[9.0, 9.0, -0.71], [0, 0, -0.69]])).tolist() == [
        True,
        False,
    ]


def test_static_points_of_the_background_have_their_verdict(robot, skin):
    from tests.fakes import frame

    cloud = SkinCloud(robot, skin, ())
    posture = robot.posture(robot.home)
    cloud.background.learn(0.0, 1.0)
    for i in range(16):
        cloud.take([frame(15, i / 15, 1.5)], posture, P)
    cloud.background.finish(1.1)
    cloud.take([frame(15, 1.2, 1.5)], posture, P)
    assert set(cloud.view(1.2, P).verdict[64 * 15 : 64 * 16]) == {Verdict.STATIC}
