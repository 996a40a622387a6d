"""Where each zone of each sensor looks."""

from math import radians, tan

import numpy as np
import pytest

from app.errors import RobotError
from app.robot.model import find_robot, load_robot
from app.robot.sensor_type import load_sensor_type
from app.robot.skin import Sensor, build_skin, zone_directions
from app.robot.skin_file import load_skin
from app.robot.tables import Choice
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.world import World


def sensor(kind="vl53l8cx", rotation_deg=0, mirrored=False):
    return Sensor("s", "forearm_link", np.eye(4), load_sensor_type(kind), rotation_deg, mirrored)


def look(s, row, column):
    return zone_directions(s, np.array([float(row)]), np.array([float(column)]))[0]


def test_zone_centres_follow_the_datasheet_angles():
    corner = tan(radians(3.5 * 45 / 8))
    assert look(sensor(), 0, 0) == pytest.approx([-corner, -corner, 1.0])
    assert look(sensor(), 7, 7) == pytest.approx([corner, corner, 1.0])
    corner = tan(radians(1.5 * 45 / 4))
    assert look(sensor("vl53l8cx-4x4"), 0, 3) == pytest.approx([corner, -corner, 1.0])


def test_mirroring_swaps_columns_and_rotation_turns_clockwise():
    plain = look(sensor(), 0, 2)
    assert look(sensor(mirrored=True), 0, 5) == pytest.approx(plain)
    # the upper edge's middle turns to the right edge's middle
    top = look(sensor(), 0, 3.5)
    assert top[0] == pytest.approx(0.0)
    turned = look(sensor(rotation_deg=90), 0, 3.5)
    assert turned == pytest.approx([-top[1], 0.0, 1.0], abs=1e-12)
    assert look(sensor(rotation_deg=180), 7, 7) == pytest.approx(look(sensor(), 0, 0))


def test_the_reach_of_a_zone_is_per_depth_not_per_ray(robot):
    skin = build_skin("one", (sensor(),), robot)
    assert skin.reach[:, 2] == pytest.approx(np.ones(64))


def test_the_rings_look_outwards_from_60_mm(robot):
    skin = load_skin(robot.folder / robot.skin, robot)
    assert skin.count == 30
    centre = np.array([0.0, 0.0, 0.0393])
    across = (skin.origin - centre) * [0.0, 1.0, 1.0]
    assert np.linalg.norm(across, axis=1) == pytest.approx(np.full(30, 0.060), abs=1e-6)
    assert np.einsum("ij,ij->i", across, skin.axis) == pytest.approx(np.full(30, 0.060), abs=1e-6)
    for s in skin.sensors:
        R = s.T_link_sensor[:3, :3]
        assert np.allclose(R @ R.T, np.eye(3), atol=1e-9) and np.linalg.det(R) > 0


@pytest.mark.parametrize("layout", ["forearm-rings", "sparse-4x4"])
def test_no_lens_is_inside_any_mesh_it_rides_on_and_no_ray_of_it_meets_one(layout):
    import trimesh

    robot = load_robot(find_robot("ur10e"), Choice(skin=layout))
    skin = load_skin(robot.layout, robot)
    eye = SimulatedSkin(robot, skin, World(()), 0, ErrorModel(ideal=True))
    posture = robot.posture(robot.home)
    for k in range(skin.count):
        own = np.flatnonzero(robot.welded[skin.link[k]])
        for link in own:
            body = trimesh.Trimesh(robot.bodies[link].vertices, robot.bodies[link].faces)
            assert not body.contains(skin.origin[k : k + 1]).any()
        assert not np.isin(eye.read(k, posture).label, own).any()


def test_layouts_with_4x4_sensors_on_other_links_load(robot):
    skin = load_skin(robot.folder / "skin/sparse-4x4.toml", robot)
    assert skin.slots == 4 * 16 + 64
    assert set(skin.link) == {robot.link_index("forearm_link"), robot.link_index("wrist_3_link")}


RING = """title = "t"
[[ring]]
name = "r"
link = "forearm_link"
centre_m = [0.0, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
start = [0.0, 0.0, 1.0]
radius_m = 0.06
count = 3
"""


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("forearm_link", "forearm", r"link = 'forearm' .*did you mean 'forearm_link'"),
        (
            "count = 3",
            "count = 0",
            r"skin.toml: ring 'r': count = 0; give .*from 1 up to 100",
        ),
        (
            "radius_m = 0.06",
            "radius = 0.06",
            r"ring 'r': unknown key 'radius'; did you",
        ),
        ("axis = [1.0, 0.0, 0.0]", "axis = [0.0, 0.0, 0.0]", r"ring\[0\]: axis .*no direction"),
        ("start = [0.0, 0.0, 1.0]", "start = [2.0, 0.0, 0.0]", r"start is parallel"),
        ("count = 3", "count = 3\nrotation_deg = 45", r"ring 'r': rotation_deg = 45; give 0 or 90"),
        (RING, 'title = "t"', r"has no sensor"),
        ('title = "t"', "title = 3", r"title = 3; give a text in quotes"),
    ],
)
def test_a_broken_layout_is_named_with_file_key_and_remedy(robot, tmp_path, old, new, says):
    file = tmp_path / "skin.toml"
    file.write_text(RING.replace(old, new))
    with pytest.raises(RobotError, match=says) as error:
        load_skin(file, robot)
    assert "skin.toml" in str(error.value) and "\n" not in str(error.value)


def test_a_name_used_twice_is_refused(robot, tmp_path):
    file = tmp_path / "skin.toml"
    file.write_text(RING + RING.split("\n", 1)[1])
    with pytest.raises(RobotError, match="'r-01' is used twice"):
        load_skin(file, robot)
