"""Covers belong to a layout: they follow from it and from the link's mesh, for any round link."""

import hashlib
import shutil

import numpy as np
import pytest
import trimesh

from app.errors import RobotError
from app.robot.file_cache import SUMS, cached_folder
from app.robot.meshes import BodyMesh
from app.robot.model import find_robot, load_robot
from app.robot.roundness import circle, round_stretch
from app.robot.skin_file import load_skin
from app.robot.tables import Choice
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.world import World

RING = """
[[ring]]
name = "{name}"
link = "upper_arm_link"
centre_m = [{x}, 0.0, 0.1762]
axis = [-1.0, 0.0, 0.0]
start = [0.0, 0.0, 1.0]
radius_m = {radius}
count = {count}
"""


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """A cache of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache/flinch/covers"


def layout(tmp_path, name="r", x=-0.3, radius=0.075, count=8, cover="[cover]", more=""):
    file = tmp_path / "layout.toml"
    ring = RING.format(name=name, x=x, radius=radius, count=count)
    file.write_text(f'title = "mine"\n{cover}\n{ring}{more}')
    return file


def dressed(file):
    """The UR10e in the covers of a layout, and its skin."""
    robot = load_robot(find_robot("ur10e"), Choice(skin=str(file)))
    return robot, load_skin(file, robot)


def mesh(body: BodyMesh):
    return trimesh.Trimesh(body.vertices, body.faces)


def test_another_layout_is_dressed_in_its_own_covers_and_not_in_the_defaults(tmp_path):
    robot, _ = dressed(layout(tmp_path))
    assert "forearm_cover" not in robot.links
    cover = robot.link_index("upper_arm_cover")
    assert cover == robot.link_index("upper_arm_link") + 1  # next to what wears it
    assert robot.welded[cover, cover - 1] and np.array_equal(*robot.supports[cover - 1 : cover + 1])
    solid = mesh(robot.bodies[cover])
    assert solid.is_volume and solid.body_count == 1 and len(solid.faces) <= 1000
    bore = np.hypot(solid.vertices[:, 1], solid.vertices[:, 2] - 0.1762).min()
    assert 0.0552 < bore < 0.0570  # the tube's radius is 55.2 mm
    assert solid.bounds[:, 0] == pytest.approx([-0.323, -0.277], abs=1e-4)
    assert robot.layout == tmp_path / "layout.toml"


@pytest.mark.parametrize("tilt", [0.0, 25.0])
@pytest.mark.parametrize("kind", ["vl53l8cx", "vl53l7cx", "vl53l1x"])  # 45, 60 and 27 degrees wide
def test_no_lens_is_inside_its_cover_and_no_ray_of_it_meets_one(tmp_path, tilt, kind):
    file = layout(tmp_path)
    file.write_text(file.read_text() + f'tilt_deg = {tilt}\ntype = "{kind}"\n')
    robot, skin = dressed(file)
    cover = mesh(robot.bodies[robot.link_index("upper_arm_cover")])
    assert not cover.contains(skin.origin).any()
    assert 0.0 < -trimesh.proximity.signed_distance(cover, skin.origin).max() < 1.5e-3
    eye = SimulatedSkin(robot, skin, World(()), 0, ErrorModel(ideal=True))
    posture = robot.posture(robot.home)
    for k in range(skin.count):
        own = np.flatnonzero(robot.welded[skin.link[k]])
        assert not np.isin(eye.read(k, posture).label, own).any()


def test_a_robot_may_wear_no_cover_at_all(tmp_path):
    bare = load_robot(find_robot("ur10e"), Choice(skin="none"))
    assert bare.layout is None and len(bare.links) == 7
    for cover in ("", "[cover]"):
        file = layout(tmp_path, cover=cover)
        if cover:
            file.write_text(file.read_text() + "cover = false\n")
        assert dressed(file)[0].links == bare.links


def test_rings_on_two_links_make_two_covers(tmp_path):
    more = """
[[ring]]
name = "fore"
link = "forearm_link"
centre_m = [-0.3, 0.0, 0.0393]
axis = [-1.0, 0.0, 0.0]
start = [0.0, 0.0, 1.0]
radius_m = 0.06
count = 10
"""
    robot, _ = dressed(layout(tmp_path, more=more))
    assert [n for n in robot.links if n.endswith("_cover")] == ["upper_arm_cover", "forearm_cover"]
    told = layout(tmp_path, cover='[cover]\nbody = "x.stl"', more=more)
    with pytest.raises(
        RobotError, match=r"rings sit on upper_arm_link, forearm_link; leave `body`"
    ):
        dressed(told)


def test_covers_that_a_cad_program_made_are_taken_as_they_are(tmp_path):
    solid = trimesh.creation.annulus(0.056, 0.07, 0.02, transform=turned(-0.3))
    solid.export(tmp_path / "mine.stl")
    robot, _ = dressed(layout(tmp_path, cover='[cover]\nbody = "mine.stl"'))
    taken = mesh(robot.bodies[robot.link_index("upper_arm_cover")])
    assert taken.bounds == pytest.approx(solid.bounds, abs=1e-6)
    assert not (tmp_path / "cache").exists()


def turned(x):
    T = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0])
    T[:3, 3] = [x, 0.0, 0.1762]
    return T


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"x": -0.02}, r"not round about the ring's axis|does not go all round"),
        ({"radius": 0.05}, r"does not go all round within radius_m = 0.05"),
        ({"radius": 0.0565}, r"leaves no room for a cover.*give at least 0.057"),
        ({"count": 60}, r"60 windows do not fit.*at most 46"),
    ],
)
def test_a_cover_that_does_not_fit_is_told_with_the_remedy(tmp_path, change, says):
    with pytest.raises(RobotError, match=says) as error:
        dressed(layout(tmp_path, **change))
    assert "\n" not in str(error.value) and "layout.toml: ring[0] 'r'" in str(error.value)


def test_a_link_that_is_not_round_can_be_given_its_bore(tmp_path):
    file = layout(tmp_path, x=-0.02, radius=0.12, cover="[cover]\ninner_radius_m = 0.1")
    assert "upper_arm_cover" in dressed(file)[0].links


def test_an_unknown_link_of_a_ring_is_told_with_those_that_there_are(tmp_path):
    file = layout(tmp_path)
    file.write_text(file.read_text().replace("upper_arm_link", "upper_arm"))
    with pytest.raises(RobotError, match=r"no link of the robot; did you mean 'upper_arm_link'"):
        dressed(file)


# --- the cache ----------------------------------------------------------------------------


def sums(folder):
    return {f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in folder.iterdir()}


def test_a_cover_is_made_once_and_again_when_it_is_damaged(tmp_path, cache):
    file = layout(tmp_path)
    dressed(file)
    (folder,) = cache.iterdir()
    good, made = sums(folder), (folder / "body.stl").stat().st_mtime_ns
    assert set(good) == {"body.stl", "visual.glb", SUMS}
    dressed(file)
    assert (folder / "body.stl").stat().st_mtime_ns == made
    for name, damage in (
        ("body.stl", lambda p: p.write_bytes(p.read_bytes()[:-7] + b"\0" * 7)),
        ("visual.glb", lambda p: p.unlink()),
        (SUMS, lambda p: p.write_bytes(b"\xff\xfe")),
        ("body.stl", lambda p: p.write_bytes(b"")),
    ):
        damage(folder / name)
        dressed(file)
        assert sums(folder) == good, name


def test_what_a_cover_follows_from_names_its_folder(tmp_path, cache):
    for change in ({}, {"count": 9}, {"radius": 0.076}, {"x": -0.31}, {"name": "other"}):
        dressed(layout(tmp_path, **change))
    assert len(list(cache.iterdir())) == 4  # a ring's name changes nothing


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    robot, _ = dressed(layout(tmp_path))
    assert "upper_arm_cover" in robot.links


def test_a_cache_keeps_the_newest_only(tmp_path, monkeypatch):
    monkeypatch.setattr("app.robot.file_cache.MOST", 3)
    for k in range(5):
        folder = cached_folder("covers", f"k{k}", lambda f: (f / "a").write_text("a"))
        shutil.os.utime(folder, (k, k))
    assert {f.name for f in folder.parent.iterdir()} >= {"k4", "k3"}
    assert len(list(folder.parent.iterdir())) == 3


# --- where a link is round ----------------------------------------------------------------


def body(*meshes):
    whole = trimesh.util.concatenate(meshes)
    return BodyMesh(np.array(whole.vertices), np.array(whole.faces, dtype=np.int64))


@pytest.mark.parametrize("sides", [12, 28, 48])
def test_a_cut_cylinder_is_a_circle_wherever_it_stands(sides):
    rng = np.random.default_rng(3)
    for _ in range(10):
        T = trimesh.transformations.random_rotation_matrix(rng.random(3))
        T[:3, 3] = rng.uniform(-1, 1, 3)
        tube = body(trimesh.creation.cylinder(0.05, 0.3, sections=sides, transform=T))
        axis = T[:3, 2]
        found = circle(tube, T[:3, 3] + 0.02 * axis, axis)
        assert np.linalg.norm(found.centre - T[:3, 3] - 0.02 * axis) < 1e-3
        assert found.radius == pytest.approx(0.05, rel=0.002)


def test_a_box_and_a_tube_that_is_open_on_one_side_are_not_round():
    box = body(trimesh.creation.box((0.1, 0.1, 0.3)))
    assert circle(box, np.zeros(3), np.array([0.0, 0.0, 1.0])) is None
    assert round_stretch(body(trimesh.creation.box((0.1, 0.12, 0.3)))) is None
    tube = trimesh.creation.cylinder(0.05, 0.3, sections=64)
    tube.update_faces(tube.triangles_center[:, 0] < 0.03)
    assert circle(body(tube), np.zeros(3), np.array([0.0, 0.0, 1.0])) is None


def test_the_round_stretch_of_a_link_is_its_tube_between_two_housings():
    tube = trimesh.creation.cylinder(0.04, 0.4)
    ends = [
        trimesh.creation.box((0.12, 0.12, 0.1)).apply_translation([0, 0, z]) for z in (-0.2, 0.2)
    ]
    found = round_stretch(body(tube, *ends))
    assert found.radius == pytest.approx(0.04, rel=0.01)
    assert sorted([found.low[2], found.high[2]]) == pytest.approx([-0.15, 0.15], abs=0.01)
    assert np.abs([found.low[:2], found.high[:2]]).max() < 1e-3


def test_the_tubes_of_the_shipped_arms_are_found():
    arm = load_robot(find_robot("ur10e"), Choice(skin="none"))
    for link, radius, z in (("upper_arm_link", 0.0552, 0.1762), ("forearm_link", 0.0427, 0.0393)):
        found = round_stretch(arm.bodies[arm.link_index(link)])
        assert found.radius == pytest.approx(radius, rel=0.12)  # tapered at its ends
        assert found.length > 0.3 and abs(found.axis[0]) == pytest.approx(1.0)
        assert found.low[1:] == pytest.approx([0.0, z], abs=2e-3)
