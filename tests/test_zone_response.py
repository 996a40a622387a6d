"""What a simulated zone makes of what is in it, held against sums made here by hand."""

from dataclasses import replace

import numpy as np
import pytest

from app.messages import freeze
from app.robot.sensor_type import load_sensor_type
from app.robot.skin import Sensor, build_skin
from app.sensing.budget import HONEST, IDEAL
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.motion import Still
from app.world.shapes import make_shape
from app.world.world import Body, World

ZONES = replace(IDEAL, zones=1.0, sub=9)  # a real zone, and else nothing amiss
EXACT = ErrorModel(ideal=True)
VALID, MERGED = 5, 9  # UM3109
WIDTH = np.radians(45.0 / 8)  # of a zone


@pytest.fixture(scope="module")
def ahead(robot):
    """One sensor at the tool flange that looks along the flange's axis."""
    T = np.eye(4)
    T[2, 3] = 0.01
    kind = load_sensor_type("vl53l8cx")
    return build_skin("one", (Sensor("ahead", "wrist_3_link", T, kind, 0, False),), robot)


def plate(robot, depth, reflectance=0.5, tilt=0.0, left=-3.0, right=3.0):
    """A thin plate square to the sensor of `ahead`, from `left` to `right` [m] in its picture."""
    T = robot.posture(robot.home).T_base_link[-1] @ np.diag([1.0, 1, 1, 1])
    place, turn = np.eye(4), np.eye(4)
    c, s = np.cos(tilt), np.sin(tilt)
    turn[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    place[:3, 3] = (left + right) / 2, 0.0, 0.01 + depth
    size = [float(right - left), 6.0]
    shape = make_shape({"kind": "panel", "size_m": size, "thickness_m": 1e-4}, None, "plate")
    motion = Still(freeze(T @ place @ turn))
    return Body(f"plate at {depth}", shape, (0, 0, 0), motion, True, reflectance)


def read(robot, ahead, *plates, budget=ZONES):
    eye = SimulatedSkin(robot, ahead, World(plates), 0, EXACT, budget=budget)
    return eye.read(0, robot.posture(robot.home))


def frames(robot, ahead, *plates, n=200, budget=ZONES, errors=None, seed=0):
    """Distance [m], NaN without a target, and status (n, 64) of what is reported."""
    eye = SimulatedSkin(
        robot, ahead, World(plates), seed, errors or ErrorModel(bias=0.0, rejected=0.0),
        latency=0.0, budget=budget,
    )  # fmt: skip
    posture = robot.posture(robot.home)
    found = [f for i in range(n) for f in eye.poll(i / 15.0, posture)]
    distance = np.array([np.where(f.targets > 0, f.distance, np.nan) for f in found])
    return distance, np.array([f.status for f in found])


def test_a_wall_square_to_the_axis_is_the_same_depth_in_every_zone(robot, ahead):
    seen = read(robot, ahead, plate(robot, 0.7))
    assert seen.depth == pytest.approx(np.full(64, 0.7), abs=2e-4)
    assert not seen.merged.any() and seen.pure.all() and (seen.label == -1).all()


@pytest.mark.parametrize("degrees", [30, 50, 65])
def test_a_slanted_wall_is_met_near_the_middle_of_each_zone_and_leans_to_its_near_side(
    robot, ahead, degrees
):
    tilt = np.radians(degrees)
    seen = read(robot, ahead, plate(robot, 0.5, tilt=tilt)).depth.reshape(8, 8)
    # along a zone's middle ray [tan a, tan b, 1] lies the wall z = 0.5 - x tan(tilt)
    a = np.tan((np.arange(8) - 3.5) * WIDTH)
    off = seen[3] * (1.0 + a * np.tan(tilt)) / 0.5 - 1.0
    aslant = np.degrees(tilt - np.arctan(a))  # of the middle rays to the wall's normal
    steep = aslant < 60
    assert np.abs(off[steep]).max() < 0.02 and off.max() < 1e-3
    assert (off[~steep] > -0.35).all()  # it is spread over metres there


def light(reflectance, depth, share):
    return share * reflectance / depth**2


@pytest.mark.parametrize(("near", "far"), [(0.5, 0.5), (0.05, 0.9), (0.9, 0.05)])
def test_a_plate_before_a_wall_is_reported_from_a_tenth_of_the_zones_light_on(
    robot, ahead, near, far
):
    d, wall, found, told = 0.4, 1.6, [], []
    for share in np.linspace(0.004, 0.6, 40):
        # the plate covers so much of the zones of column 4, from the left: angles 0 to WIDTH
        edge = d * np.tan(share * WIDTH)
        seen = read(
            robot, ahead, plate(robot, d, near, left=-3.0, right=edge), plate(robot, wall, far)
        )
        of_plate, of_wall = light(near, d, share), light(far, wall, 1.0 - share)
        found.append(seen.depth.reshape(8, 8)[:, 4] < 1.0)
        told.append(of_plate / (of_plate + of_wall) > 0.1)
    assert 0 < np.sum(told) <= 40
    assert np.mean(np.array(found) == np.array(told)[:, None]) > 0.93  # but at the very edge


def test_two_targets_nearer_than_60_cm_are_one_that_lies_between_them(robot, ahead):
    plates = plate(robot, 0.6, right=0.6 * np.tan(0.5 * WIDTH)), plate(robot, 0.9)
    seen = read(robot, ahead, *plates)
    half, left = (column.reshape(8, 8).T for column in (seen.depth, seen.merged))
    assert half[:4] == pytest.approx(np.full((4, 8), 0.6), abs=1e-3)  # covered
    assert (half[4] > 0.605).all() and (half[4] < 0.75).all() and left[4].all()
    assert half[5:] == pytest.approx(np.full((3, 8), 0.9), abs=1e-3)


def test_two_targets_farther_apart_than_60_cm_are_told_apart(robot, ahead):
    seen = read(
        robot, ahead, plate(robot, 0.6, right=0.6 * np.tan(0.5 * WIDTH)), plate(robot, 1.25)
    )
    assert seen.depth.reshape(8, 8)[:, 4] == pytest.approx(np.full(8, 0.6), abs=1e-3)
    assert not seen.merged.any()


@pytest.mark.parametrize("sub", [4, 5, 7])
def test_the_number_of_rays_changes_little_but_near_an_edge(robot, ahead, sub):
    plates = plate(robot, 0.5, tilt=0.6), plate(robot, 0.3, left=0.05, right=0.08)
    fine = read(robot, ahead, *plates, budget=replace(ZONES, sub=15)).depth
    few = read(robot, ahead, *plates, budget=replace(ZONES, sub=sub)).depth
    assert np.median(np.abs(few - fine)) < 0.003


def test_noise_grows_as_the_light_falls(robot, ahead):
    spread = {}
    for rho in (0.9, 0.5, 0.1):
        d, _ = frames(robot, ahead, plate(robot, 0.6, rho), budget=replace(ZONES, ranges=1.0))
        spread[rho] = np.nanmedian(np.nanstd(d, axis=0))
    assert spread[0.5] == pytest.approx(0.0065 * 0.6, rel=0.1)  # as measured
    assert spread[0.9] < 0.9 * spread[0.5] and 1.6 < spread[0.1] / spread[0.5] < 2.6


@pytest.mark.parametrize(
    ("rho", "klux", "reach"), [(0.88, 0, 3.5), (0.17, 0, 1.3), (0.88, 5, 1.1), (0.17, 5, 0.8)]
)
def test_targets_of_the_datasheet_are_found_as_far_as_it_says(robot, ahead, rho, klux, reach):
    errors = ErrorModel(bias=0.0, rejected=0.0, light_klux=klux)
    d, _ = frames(robot, ahead, plate(robot, reach, rho), errors=errors)
    inner = np.isfinite(d).reshape(-1, 8, 8)[:, 3:5, 3:5].mean()
    assert inner == pytest.approx(0.9, abs=0.05)  # DS13754: in 90 % of the frames


def test_a_slanted_dark_wall_is_lost_before_a_square_light_one(robot, ahead):
    kept = [
        np.isfinite(frames(robot, ahead, plate(robot, 1.0, rho, tilt), n=50)[0]).mean()
        for rho, tilt in ((0.9, 0.0), (0.1, 0.0), (0.1, 1.1))
    ]
    assert kept[0] == 1.0 and kept[0] > kept[1] > kept[2]


def test_zones_are_off_by_one_and_a_half_percent_whatever_the_seed(robot, ahead):
    off = []
    for seed in range(12):
        d, _ = frames(robot, ahead, plate(robot, 0.8), n=25, errors=ErrorModel(), seed=seed)
        off.append(np.nanmean(d, axis=0) / 0.8 - 1.0)
    off = np.array(off)
    assert off.std() == pytest.approx(0.015, rel=0.1) and abs(off.mean()) < 0.002
    assert np.abs(off.mean(axis=0)).max() < 0.02  # no zone is wrong the same way in every seed


def test_one_window_in_ten_is_dirty_and_draws_near_dark_targets_to_itself(robot, skin, ahead):
    dirty = np.array([
        SimulatedSkin(robot, skin, World(()), s, budget=replace(ZONES, sub=3, cover=1.0))
        ._measurement._sight.window > 0 for s in range(12)
    ])  # fmt: skip
    assert dirty.mean() == pytest.approx(0.1, abs=0.04)
    budget = replace(ZONES, cover=10.0)  # all of them
    for rho, far, least, most in ((0.08, 0.25, 0.004, 0.08), (0.9, 1.0, 0.0, 1e-3)):
        off = far - read(robot, ahead, plate(robot, far, rho), budget=budget).depth
        assert least < off.mean() < most or abs(off.mean()) < most == 1e-3
    _, status = frames(robot, ahead, budget=budget, n=400)
    assert np.mean(status == VALID) == pytest.approx(1e-3, rel=0.5)  # returns from the window


def test_a_body_keeps_its_reflectance_by_its_name(robot, ahead):
    world = World((plate(robot, 1.0, None), plate(robot, 2.0, None)))
    eye = SimulatedSkin(robot, ahead, world, 3, budget=replace(HONEST, mounting=0.0))
    finish = eye._measurement._sight._finish
    one, two = finish.surfaces(world.bodies).bodies
    world.add("ball", {"kind": "sphere", "radius_m": 0.1}, (0, 0, 3))
    more = finish.surfaces(world.bodies).bodies
    assert one != two and (more[:2] == (one, two)).all() and 0.05 <= more.min() <= more.max() <= 0.9
