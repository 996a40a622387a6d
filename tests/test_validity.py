"""Which points are believed: ghosts, status sets, and the named states of a sensor."""

import msgspec
import numpy as np
import pytest

from app.cell.parts import Cell
from app.messages import SensorHealth, Verdict
from app.perception.cloud import SkinCloud
from app.perception.health import SkinHealth
from app.perception.rules import Rules
from app.robot.skin import build_skin
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.world import World
from tests.fakes import frame, retyped

P = Rules()
SENSOR = 15  # looks away from the arm at home
ZONE = 27


def verdicts(robot, skin, depths, rules=P):
    """Verdicts of the sensor's zones after each frame of `depths`, one frame a period."""
    cloud = SkinCloud(robot, skin, Cell())
    posture = robot.posture(robot.home)
    out = []
    for i, depth in enumerate(depths):
        cloud.add_frames([frame(SENSOR, i / 15, depth)], posture, rules)
        out.append(cloud.view(i / 15).verdict[64 * SENSOR : 64 * SENSOR + 64])
    return out


def wall(depth=1.5, **zones):
    d = np.full(64, depth)
    for zone, value in zones.items():
        d[int(zone[1:])] = value
    return d


def test_a_nearer_point_of_one_zone_in_one_frame_is_a_ghost(robot, skin):
    first, second, third = verdicts(robot, skin, [wall(), wall(z27=0.5), wall()])
    assert first[ZONE] == third[ZONE] == Verdict.KEPT
    assert second[ZONE] == Verdict.GHOST
    assert (np.delete(second, ZONE) == Verdict.KEPT).all()


def test_a_point_seen_twice_is_believed_also_by_the_zone_beside_the_first(robot, skin):
    assert verdicts(robot, skin, [wall(), wall(z27=0.5), wall(z27=0.48)])[2][27] == Verdict.KEPT
    assert verdicts(robot, skin, [wall(), wall(z27=0.5), wall(z28=0.48)])[2][28] == Verdict.KEPT


def test_two_neighbouring_zones_are_believed_at_once(robot, skin):
    second = verdicts(robot, skin, [wall(), wall(z27=0.5, z28=0.52)])[1]
    assert second[27] == second[28] == Verdict.KEPT


def test_what_is_near_the_robot_is_believed_at_once(robot, skin):
    assert verdicts(robot, skin, [wall(), wall(z27=0.12)])[1][27] == Verdict.KEPT


def test_a_point_that_recedes_is_believed_at_once(robot, skin):
    assert verdicts(robot, skin, [wall(0.6), wall(0.6, z27=1.4)])[1][27] == Verdict.KEPT


def test_without_the_filter_ghosts_pass(robot, skin):
    open_eyed = P._replace(doubts_ghosts=False)
    assert verdicts(robot, skin, [wall(), wall(z27=0.5)], open_eyed)[1][27] == Verdict.KEPT


def test_simulated_ghosts_are_caught(robot, skin):
    """In an empty world every point of the world is a ghost, and hardly one passes."""
    eye = SimulatedSkin(robot, skin, World(()), 3, ErrorModel(ghosts=0.002), latency=0.0)
    cloud = SkinCloud(robot, skin, Cell())
    posture = robot.posture(robot.home)
    ghosts = passed = 0
    for i in range(150):
        frames = eye.poll(i / 75, posture)
        for f in frames:
            cloud.add_frames([f], posture, P)
            mine = slice(64 * f.sensor, 64 * f.sensor + 64)
            view = cloud.view(i / 75)
            far = (f.distance > 0.15) & (view.gap[mine] > 0.15)
            ghosts += (view.verdict[mine][far] == Verdict.GHOST).sum()
            passed += (view.verdict[mine][far] == Verdict.KEPT).sum()
    assert ghosts > 30
    assert passed < 0.1 * ghosts


def test_merged_pulses_are_trusted_only_if_the_type_says_so(robot, skin):
    said = skin.sensors[0].type
    for trusted, expected in (((5, 9), Verdict.KEPT), ((5,), Verdict.BAD_STATUS)):
        status = msgspec.structs.replace(said.status, trusted=trusted)
        wary = retyped(skin, msgspec.structs.replace(said, status=status), robot)
        cloud = SkinCloud(robot, wary, Cell())
        cloud.add_frames([frame(SENSOR, 0.0, 1.5, status=9)], robot.posture(robot.home), P)
        assert cloud.view(0.0).verdict[64 * SENSOR + ZONE] == expected


def health_of_one(robot, skin):
    """Of a skin of one sensor, which is connected."""
    health = SkinHealth(build_skin("one", skin.sensors[:1], robot))
    health.connect(np.array([True]))
    return health


def noisy(rng, i, **kind):
    return frame(0, kind.pop("stamp", i / 15), 1.0 + rng.normal(0, 0.005, 64), **kind)


@pytest.mark.parametrize(
    ("make", "state"),
    [
        (lambda rng, i: noisy(rng, i), SensorHealth.GOOD),
        (lambda rng, i: frame(0, i / 15, 0.8), SensorHealth.FROZEN),
        (lambda rng, i: frame(0, i / 15, rng.uniform(0, 0.02, 64)), SensorHealth.SATURATED),
        (lambda rng, i: noisy(rng, i, stamp=i / 5), SensorHealth.SLOW),
        (lambda rng, i: noisy(rng, i, status=4), SensorHealth.POOR),
        (lambda rng, i: frame(0, i / 15, 0.8, status=255, targets=0), SensorHealth.GOOD),
    ],
)  # fmt: skip
def test_each_way_to_be_of_little_use_has_its_name(robot, skin, make, state):
    rng = np.random.default_rng(0)
    health = health_of_one(robot, skin)
    for i in range(40):
        f = make(rng, i)
        health.update([f], f.stamp)
    assert SensorHealth(health.states(f.stamp)[0]) is state


def test_a_repeated_stamp_is_not_taken_for_frozen_values(robot, skin):
    rng = np.random.default_rng(0)
    health = health_of_one(robot, skin)
    for i in range(20):
        f = noisy(rng, i)
        health.update([f, f, f], f.stamp)
    assert SensorHealth(health.states(19 / 15)[0]) is SensorHealth.GOOD
