"""The simulated skin: what a VL53L8CX would report, with noise and without."""

import numpy as np
import pytest

from app.robot.sensor_type import load_sensor_type
from app.robot.skin import Sensor, build_skin, zone_directions
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.scene import find_scene, load_scene
from app.world.world import World

IDEAL = ErrorModel(ideal=True)
VALID, MERGED, FIRST, UNCONFIRMED, NO_TARGET = 5, 9, 6, 10, 255  # UM3109
FAR = 4.0  # [m] nothing is seen beyond (UM3109)


@pytest.fixture
def ahead(robot):
    """One sensor at the tool flange that looks along the flange's axis."""
    T = np.eye(4)
    T[2, 3] = 0.01
    return build_skin(
        "one ahead",
        (Sensor("ahead", "wrist_3_link", T, load_sensor_type("vl53l8cx"), 0, False),),
        robot,
    )


def wall_at(robot, depth, tilt=0.0):
    """A world with a large panel `depth` before the sensor of `ahead` at the home posture."""
    T = robot.posture(robot.home).T_base_link[-1].copy()
    T[:3, 3] += T[:3, 2] * (0.01 + depth + 0.005)
    world = World(())
    world.add("wall", {"kind": "panel", "size_m": [6.0, 6.0], "thickness_m": 0.01}, (0, 0, 0))
    c, s = np.cos(tilt), np.sin(tilt)
    T[:3, :3] = T[:3, :3] @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    world.move("wall", T)
    return world


def frames_of(skin, world, robot, seconds, seed=0, errors=IDEAL):
    eye = SimulatedSkin(robot, skin, world, seed, errors)
    posture = robot.posture(robot.home)
    times = np.arange(0.0, seconds, 0.004)
    return [(t, f) for t in times for f in eye.poll(t, posture)]


def test_a_wall_square_to_the_axis_is_the_same_depth_in_every_zone(robot, ahead):
    _, frame = frames_of(ahead, wall_at(robot, 1.0), robot, 0.2)[0]
    assert frame.distance == pytest.approx(np.full(64, 1.0), abs=1e-3)  # not 1.09 in the corners
    assert (frame.status == VALID).all()


def test_a_slanted_wall_is_seen_at_its_slant(robot, ahead):
    _, frame = frames_of(ahead, wall_at(robot, 1.0, tilt=np.radians(30)), robot, 0.2)[0]
    points = ahead.reach * frame.distance[:, None]
    centred = points - points.mean(axis=0)
    normal = np.linalg.svd(centred)[2][2]
    assert abs(normal[2]) == pytest.approx(np.cos(np.radians(30)), abs=0.01)


def test_frames_come_at_15_hz_staggered_and_50_ms_late(robot, skin):
    frames = frames_of(skin, World(()), robot, 2.0)
    assert all(t - f.stamp == pytest.approx(0.05, abs=0.005) for t, f in frames)
    stamps = [f.stamp for _, f in frames if f.sensor == 7]
    assert np.mean(np.diff(stamps)) == pytest.approx(1 / 15, rel=0.03)
    per_tick = np.unique([f.stamp for _, f in frames], return_counts=True)[1]
    assert per_tick.max() <= 3


def test_nothing_within_range_is_no_target_with_junk_distances(robot, ahead):
    _, frame = frames_of(ahead, World(()), robot, 0.2, errors=ErrorModel())[0]
    assert (frame.targets == 0).all() and (frame.status == NO_TARGET).all()


def test_the_same_seed_gives_the_same_frames_and_another_seed_does_not(robot, ahead):
    def distances(seed):
        found = frames_of(ahead, wall_at(robot, 1.0), robot, 0.5, seed, ErrorModel())
        return np.array([f.distance for _, f in found])

    assert np.array_equal(distances(1), distances(1))
    assert not np.array_equal(distances(1), distances(2))


def test_noise_and_dropout_follow_the_error_model(robot, ahead):
    found = frames_of(ahead, wall_at(robot, 1.0), robot, 20.0, errors=ErrorModel())
    d = np.array([np.where(f.targets > 0, f.distance, np.nan) for _, f in found])
    assert np.nanmedian(np.nanstd(d, axis=0)) == pytest.approx(6.5e-3, rel=0.15)
    far = frames_of(ahead, wall_at(robot, 2.8), robot, 5.0, errors=ErrorModel())
    share = np.mean([f.targets > 0 for _, f in far])
    assert 0.02 < share < 0.9  # beyond the range of 90 % at half reflectance


def test_status_codes_tell_first_frame_new_target_and_bad_measurement(robot, ahead):
    found = [f for _, f in frames_of(ahead, wall_at(robot, 1.0), robot, 8.0, errors=ErrorModel())]
    assert (found[0].status == FIRST).sum() > 40
    later = np.concatenate([f.status for f in found[1:]])
    assert np.mean(np.isin(later, (2, 4))) == pytest.approx(0.06, abs=0.02)
    assert np.mean(later == VALID) > 0.85
    flicker = frames_of(ahead, wall_at(robot, 2.4), robot, 2.0, errors=ErrorModel())
    assert (np.concatenate([f.status for _, f in flicker[1:]]) == UNCONFIRMED).any()


def test_two_surfaces_close_behind_each_other_in_a_zone_are_a_merged_pulse(robot, ahead):
    world = wall_at(robot, 1.0)
    T = robot.posture(robot.home).T_base_link[-1]
    ball = T[:3, 3] + 0.8 * T[:3, 2]
    world.add("ball", {"kind": "sphere", "radius_m": 0.12}, tuple(ball))
    _, frame = frames_of(ahead, world, robot, 0.2)[0]
    assert (frame.status == MERGED).any()
    assert frame.distance.min() < 0.75  # the nearest cluster, not the mean


def test_the_skin_sees_the_robots_own_links(robot, skin):
    eye = SimulatedSkin(robot, skin, World(()), 0, IDEAL)
    q = robot.home.copy()
    q[2] = 2.6  # folded: the forearm's sensors look at the upper arm
    posture = robot.posture(q)
    labels = np.concatenate([eye.read(k, posture).label for k in range(skin.count)])
    assert (labels == robot.link_index("upper_arm_link")).sum() > 50
    assert (labels == -1).sum() == 0  # an empty world


def one_by_one(robot, skin, world, k, posture):
    """Depth and label (64, 9) of the sub-rays of sensor k, all of them cast at every body."""
    link, sensor = skin.link[k], skin.sensors[k]
    offset = np.arange(-1, 2) / 3.0
    row, column, dr, dc = np.meshgrid(np.arange(8), np.arange(8), offset, offset, indexing="ij")
    d = zone_directions(sensor, (row + dr).ravel(), (column + dc).ravel())
    d = d / np.linalg.norm(d, axis=1, keepdims=True) @ sensor.T_link_sensor[:3, :3].T
    cosine, R = d @ skin.axis[k], posture.T_base_link[link, :3, :3]
    d, o = d @ R.T, R @ skin.origin[k] + posture.T_base_link[link, :3, 3]
    bodies = [
        (i, T, m) for i, (T, m) in enumerate(zip(posture.T_base_link, robot.rigid, strict=True))
    ]
    shapes = world.shapes().values()
    bodies += [(-1, p.T_base_body, s.hit) for p, s in zip(world.poses(), shapes, strict=True)]
    length, label = np.full(len(d), 4.0), np.full(len(d), -2)
    for i, T, mesh in bodies:
        at = np.tile((o - T[:3, 3]) @ T[:3, :3], (len(d), 1)).astype(np.float32)
        t = mesh.cast(at, (d @ T[:3, :3]).astype(np.float32))
        label[t < length] = i
        length = np.minimum(t, length)
    depth = np.where(label == -2, np.inf, length * cosine)
    return depth.reshape(64, 9), label.reshape(64, 9)


def test_what_is_left_out_of_a_cast_or_joined_for_it_changes_no_reading(robot, skin):
    scene = load_scene(find_scene("cell"))
    world, rng = World(scene.bodies), np.random.default_rng(8)
    world.add("", {"kind": "sphere", "radius_m": 0.2}, (0.5, 0.3, 0.5))
    eye = SimulatedSkin(robot, skin, world, 0, IDEAL)
    compared = unlike = 0
    for _ in range(6):
        world.step(rng.uniform(0.0, 20.0))
        posture = robot.posture(robot.home + rng.uniform(-1.5, 1.5, robot.n))
        for k in range(0, skin.count, 2):
            depth, label = one_by_one(robot, skin, world, k, posture)
            least = depth.min(axis=1, keepdims=True)
            pulse = depth <= least + np.maximum(0.05, 0.1 * least)
            mean = np.where(
                np.isfinite(least[:, 0]), np.where(pulse, depth, 0.0).sum(axis=1), np.inf
            )
            mean /= pulse.sum(axis=1)
            got = eye.read(k, posture)
            nearest = np.take_along_axis(label, depth.argmin(axis=1)[:, None], axis=1)[:, 0]
            alike = np.isclose(got.depth, mean, atol=1e-5, rtol=0.0) & (got.label == nearest)
            compared, unlike = compared + alike.size, unlike + np.sum(~alike)
    assert compared == 6 * 15 * 64
    assert unlike < 1e-3 * compared  # rays that graze an edge


def test_a_range_beyond_four_metres_is_never_reported(robot, ahead):
    _, frame = frames_of(ahead, wall_at(robot, 3.9), robot, 0.2)[0]
    assert (frame.distance[frame.targets > 0] <= FAR).all() and (frame.targets > 0).any()
    _, frame = frames_of(ahead, wall_at(robot, 4.1), robot, 0.2)[0]
    assert not frame.targets.any()


def test_a_muted_sensor_says_nothing_and_the_others_go_on(robot, skin):
    eye = SimulatedSkin(robot, skin, World(()), 0, IDEAL)
    eye.muted.add(3)
    posture = robot.posture(robot.home)
    heard = {f.sensor for t in np.arange(0, 0.3, 0.004) for f in eye.poll(t, posture)}
    assert heard == set(range(30)) - {3}


def test_after_a_stall_a_sensor_sends_one_frame_not_a_burst(robot, ahead):
    eye = SimulatedSkin(robot, ahead, World(()), 0, IDEAL, latency=0.0)
    posture = robot.posture(robot.home)
    eye.poll(0.0, posture)
    assert len(eye.poll(1.0, posture)) == 1
    assert len(eye.poll(1.004, posture)) == 0


def told(eye, robot, seconds, mute=lambda t: set()):
    """Every frame of a skin at the home posture by sensor and number, as bytes."""
    posture = robot.posture(robot.home)
    out = {}
    for t in np.arange(0.0, seconds, 0.004):
        eye.muted = mute(t)
        for f in eye.poll(t, posture):
            what = (f.distance.tobytes(), f.status.tobytes(), f.targets.tobytes())
            out[f.sensor, f.sequence] = (f.stamp, *what)
    return out


def cluttered(robot):
    world = World(())
    for i, place in enumerate(np.random.default_rng(3).uniform(-0.8, 0.8, (8, 3))):
        world.add(f"ball {i}", {"kind": "sphere", "radius_m": 0.15}, tuple(place))
    return world


def test_muting_a_sensor_for_a_while_changes_no_frame_of_the_others(robot, skin):
    def run(mute):
        eye = SimulatedSkin(robot, skin, cluttered(robot), 4, ErrorModel(ghosts=0.05))
        return told(eye, robot, 0.8, mute)

    all_speak, one_rests = (
        run(lambda t: set()),
        run(lambda t: {11} if 0.2 < t < 0.5 else set()),
    )
    others = {key: said for key, said in all_speak.items() if key[0] != 11}
    assert len(others) > 250
    assert others == {key: said for key, said in one_rests.items() if key[0] != 11}
    assert len(one_rests) < len(all_speak)


def reported(robot, ahead, **changes):
    """Distance and status (n, 64) that one sensor reports of a wall at a metre."""
    found = [f for _, f in frames_of(ahead, wall_at(robot, 1.0), robot, 4.0, 1,
                                     ErrorModel(**changes))]  # fmt: skip
    return (np.array([getattr(f, name) for f in found]) for name in ("distance", "status"))


def test_strays_that_are_switched_off_leave_all_other_zones_as_they_were(robot, ahead):
    (with_it, _), (without, _) = reported(robot, ahead, ghosts=0.1), reported(robot, ahead)
    assert np.mean(with_it == without) == pytest.approx(0.9, abs=0.02)


def test_statuses_that_are_switched_off_leave_every_distance_as_it_was(robot, ahead):
    with_it, status = reported(robot, ahead)
    without, plain = reported(robot, ahead, rejected=0.0)
    assert (with_it == without).all()
    assert np.mean(status != plain) == pytest.approx(0.06, abs=0.01)


def test_a_bias_that_is_switched_off_leaves_the_noise_as_it_was(robot, ahead):
    with_it, status = reported(robot, ahead)
    without, plain = reported(robot, ahead, bias=0.0)
    assert (status == plain).all()
    factor = with_it / without  # but for the rounding to millimetres one of its own in every zone
    assert np.std(factor, axis=0).max() < 1e-3
    assert np.std(factor.mean(axis=0)) == pytest.approx(0.015, rel=0.3)
