"""Self-checks of the layout and suggestions for the filter, from simulated frames."""

from dataclasses import replace

import numpy as np
import pytest

from app.checks.filter_calibration import calibrate
from app.checks.skin_check import judge_hand, judge_wall, simulate, skin_check
from app.errors import SensorError
from app.robot.skin import build_skin
from app.setup import Setup


def test_a_wall_tells_depth_along_the_axis_from_the_length_of_the_ray(robot, skin):
    depth = simulate(robot, skin, 15, "wall", 0)
    sensor = skin.sensors[15]
    assert judge_wall(depth, sensor)["convention"] == "perpendicular"
    radial = depth * np.linalg.norm(skin.reach[15 * 64 : 16 * 64], axis=1)
    found = judge_wall(radial, sensor)
    assert found["convention"] == "radial" and not found["agrees"]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("rotation", [0, 90, 180, 270])
def test_a_hand_tells_how_the_zones_are_turned_and_mirrored(robot, skin, rotation, mirrored):
    turned = tuple(replace(s, rotation_deg=rotation, mirrored=mirrored) for s in skin.sensors)
    really = build_skin("turned", turned, robot)
    depth = simulate(robot, really, 15, "hand", 0)
    assert judge_hand(depth, really.sensors[15])["agrees"]
    found = judge_hand(depth, skin.sensors[15])
    assert (found["rotation_deg"], found["mirrored"]) == (rotation, mirrored)
    assert found["agrees"] == (rotation == 0 and not mirrored)


def test_a_hand_that_rests_is_refused_with_what_to_do(skin):
    depth = np.full((60, 64), 1.0)
    depth[:, 27] = 0.3
    with pytest.raises(SensorError, match="left to right"):
        judge_hand(depth, skin.sensors[15])


def test_a_check_reports_whether_the_layout_agrees():
    report = skin_check(Setup(), "hand")
    assert report.checks[0].ok and report.rows[0]["clarity"] > 0.9


def test_a_calibration_suggests_a_threshold_for_links_that_are_seen():
    report = calibrate(Setup(), "simulated")
    seen = [r for r in report.rows if "eps_m" in r and r["eps_m"] == r["eps_m"]]
    assert seen and all(0.0 <= r["eps_m"] <= 0.05 and r["returns"] >= 200 for r in seen)
    lines = [r["line"] for r in report.rows if "line" in r]
    assert [line.split(" = ")[0] for line in lines] == ["eps_m", "eps_edge_m"]
