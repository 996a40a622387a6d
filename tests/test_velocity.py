"""The speed at which the world comes nearer: true, zero when unsure, never from a switch."""

import numpy as np
import pytest

from app.cell.parts import Cell
from app.messages import Pairs
from app.perception.cloud import SkinCloud
from app.perception.proximity import BodyPairs
from app.perception.rules import Rules
from app.perception.velocity import ObstacleSpeed
from app.sensing.simulated import SimulatedSkin
from app.world.world import World

P = Rules()
TORSO = {"kind": "capsule", "radius_m": 0.16, "length_m": 1.0}
FOREARM = 3


def approaches(robot, skin, position, seconds, sway=0.0, seed=1):
    """(n, 5): time, estimated and raw speed at the forearm's pair, its distance, and the sigma of
    the speed; the torso is at position(t)."""
    world = World(())
    world.add("torso", TORSO, position(0.0))
    world.add("wall", {"kind": "box", "size_m": [4.0, 0.05, 3.0]}, (0.3, 2.6, 0.5))
    eye = SimulatedSkin(robot, skin, world, seed)
    cloud, body, speed = SkinCloud(robot, skin, Cell()), BodyPairs(robot), ObstacleSpeed(skin)
    before, out = {}, []
    for i in range(round(seconds * 75)):
        t = i / 75
        pose = np.eye(4)
        pose[:3, 3] = position(t)
        world.move("torso", pose)
        q = robot.home + sway * np.sin(np.array([1.1, 0.9, 1.3, 1.7, 1.2, 0.8]) * t)
        posture = before[round(t, 6)] = robot.posture(q)
        for f in eye.poll(t, posture):
            cloud.add_frames([f], before[round(f.stamp, 6)], P)
            speed.take(cloud.newest(), np.array([f.sensor]))
        pairs = speed.update(body.update(cloud.view(t), posture), t)
        raw = pairs.normal[FOREARM] @ speed._tracks.v[FOREARM]
        out.append((t, pairs.approach[FOREARM], raw, pairs.distance[FOREARM],
                    pairs.approach_sigma[FOREARM]))  # fmt: skip
    return np.array(out)


@pytest.mark.parametrize("v", [0.2, 0.6, 1.6])
def test_the_speed_of_an_approaching_body_is_found(robot, skin, v):
    errors, normalised = [], []
    for sway in (0.0, 0.2):
        out = approaches(robot, skin, lambda t: (0.35, 1.5 - v * t, 0.5), 0.9 / v, sway)
        near = out[out[:, 3] < 0.6]
        assert len(near) > 5
        errors += list(np.abs(near[:, 1] - v) / v)
        spoken = near[near[:, 1] > 0.0]
        normalised += list((spoken[:, 1] - v) / spoken[:, 4])
    assert np.median(errors) < 0.2
    if v < 1.0:  # what comes faster than a walk is near before the filter has settled
        assert 0.3 < np.sqrt(np.mean(np.square(normalised))) < 1.5


def test_nothing_moves_in_a_still_scene_while_the_arm_sways(robot, skin):
    out = approaches(robot, skin, lambda t: (0.35, 0.75, 0.5), 5.0, 0.25)
    near = out[out[:, 3] < 0.8]
    assert len(near) > 200
    assert np.percentile(np.abs(near[:, 2]), 95) < 0.08
    assert np.percentile(np.abs(near[:, 1]), 95) == 0.0


def test_a_body_that_stops_is_still_within_four_frames(robot, skin):
    out = approaches(robot, skin, lambda t: (0.35, max(1.0 - 0.3 * t, 0.70), 0.5), 2.0)
    assert np.median(out[(out[:, 0] > 0.6) & (out[:, 0] < 1.0), 1]) > 0.2
    later = out[out[:, 0] > 1.0 + 0.05 + 4 / 15 + 1 / 15]
    assert np.abs(later[:, 1]).max() < 0.1


def pairs_at(points, normal=(0.0, -1.0, 0.0)):
    n = len(points)
    at = np.asarray(points, dtype=float)
    normals = np.tile(normal, (n, 1))
    return Pairs(
        np.arange(n), np.full(n, 0.2), at + 0.2 * normals, at, normals, np.arange(n), 0
    )  # fmt: skip


def test_a_switch_between_two_still_things_is_no_motion(robot, skin):
    world = World(())
    world.add("a", TORSO, (0.1, 0.75, 0.5))
    world.add("b", TORSO, (0.65, 0.72, 0.5))
    eye = SimulatedSkin(robot, skin, world, 2, latency=0.0)
    cloud, speed = SkinCloud(robot, skin, Cell()), ObstacleSpeed(skin)
    posture = robot.posture(robot.home)
    worst = 0.0
    for i in range(300):
        for f in eye.poll(i / 75, posture):
            cloud.add_frames([f], posture, P)
            speed.take(cloud.newest(), np.array([f.sensor]))
        side = [(0.1, 0.59, 0.5), (0.65, 0.56, 0.5)][i // 7 % 2]
        worst = max(worst, float(abs(speed.update(pairs_at([side]), i / 75).approach[0])))
    assert worst == 0.0


def test_without_frames_there_is_no_speed(robot, skin):
    speed = ObstacleSpeed(skin)
    for i in range(10):
        found = speed.update(pairs_at([(0.1, 0.6, 0.5)]), i / 15)
        assert found.approach.tolist() == [0.0]
