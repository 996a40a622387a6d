"""Sensors that look into what they ride on are told by name, with the remedy."""

import json
import shutil

import numpy as np
import pytest
import trimesh

from app.cli import main
from app.robot.blind import blind_sensors, blind_words
from app.robot.model import find_robot, load_robot, load_urdf
from app.robot.skin_file import load_skin
from app.robot.tables import Choice
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """A cache of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def single(tmp_path):
    """Makes a skin of one sensor."""

    def make(robot, link, position, direction, up=(0.0, 0.0, 1.0)):
        file = tmp_path / "one.toml"
        file.write_text(
            f'title = "one"\n[[sensor]]\nname = "eye"\nlink = "{link}"\n'
            f"position_m = {vector(position)}\ndirection = {vector(direction)}\nup = {vector(up)}\n"
        )
        return load_skin(file, robot)

    return make


def vector(values):
    return [float(v) for v in values]


@pytest.mark.parametrize("name", ["ur10e", "swan7"])
def test_no_sensor_of_a_shipped_layout_is_blind(name):
    for file in (find_robot(name) / "skin").glob("*.toml"):
        robot = load_robot(find_robot(name), Choice(skin=str(file)))
        assert blind_sensors(robot, load_skin(file, robot)) == ()


def test_a_lens_inside_its_link_is_blind_and_one_before_it_is_not(robot, single):
    tube = [-0.3, 0.0, 0.0393]
    assert blind_sensors(robot, single(robot, "forearm_link", tube, [0, 1, 0]))[0].ahead == 0.0
    beside = [-0.235, 0.06, 0.0393]
    assert blind_sensors(robot, single(robot, "forearm_link", beside, [0, 1, 0])) == ()


def test_a_sensor_that_looks_back_at_its_link_is_blind_and_told_how_near_it_is(robot, single):
    above = [-0.235, 0.0, 0.0393 + 0.0427 + 0.03]
    (blind,) = blind_sensors(robot, single(robot, "forearm_link", above, [0, 0, -1], [1, 0, 0]))
    assert blind.link == "forearm_link" and blind.ahead == pytest.approx(0.03, abs=2e-3)
    far = [-0.235, 0.0, 0.0393 + 0.0427 + 0.15]  # there is room for an obstacle before it
    assert blind_sensors(robot, single(robot, "forearm_link", far, [0, 0, -1], [1, 0, 0])) == ()


def test_a_sensor_before_another_ones_cover_is_blind_to_all_but_that(single):
    robot = load_robot(find_robot("ur10e"))
    skin = single(robot, "forearm_link", [-0.235, 0.0, 0.0393 + 0.05], [-1, 0, 0])
    (blind,) = blind_sensors(robot, skin)
    assert blind.link == "forearm_cover" and blind.ahead < 0.05


URDF = """<robot name="two"><link name="base"><collision><geometry><box size="0.1 0.1 0.1"/>
</geometry></collision></link><link name="arm"><collision><origin xyz="0 0 0.2"/><geometry>
<cylinder radius="0.04" length="0.3"/></geometry></collision></link><link name="plate"><collision>
<geometry><box size="0.2 0.2 0.02"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
<joint name="f" type="fixed"><parent link="arm"/><child link="plate"/><origin xyz="0 0 0.4"
 rpy="1.0 0 0"/></joint></robot>"""


def test_a_part_that_is_fixed_at_an_angle_is_seen_where_it_is(tmp_path, single):
    (tmp_path / "two.urdf").write_text(URDF)
    robot = load_urdf(tmp_path / "two.urdf")
    (blind,) = blind_sensors(robot, single(robot, "arm", [0, 0, 0.36], [0, 0, 1], [1, 0, 0]))
    assert blind.link == "plate"
    assert blind.ahead == pytest.approx(0.04 - 0.01 / np.cos(1.0), abs=4e-3)
    assert blind_sensors(robot, single(robot, "arm", [0.06, 0, 0.36], [1, 0, 0])) == ()


# --- who is told --------------------------------------------------------------------------


@pytest.fixture
def stale(tmp_path):
    """A copy of the UR10e whose first ring was moved into covers that were modelled before."""
    folder = tmp_path / "arm"
    shutil.copytree(find_robot("ur10e"), folder)
    file = folder / "skin/forearm-rings.toml"
    file.write_text(file.read_text().replace("radius_m = 0.060", "radius_m = 0.052", 1))
    return folder


WORDS = (
    "ring1-01, ring1-02, ring1-03, ring1-04, ring1-05, ring1-06, ring1-07, ring1-08, ring1-09, "
    "ring1-10 look into forearm_cover, in which the lens is, and see nothing else: raise radius_m, "
    "or move or turn them in forearm-rings.toml, and leave `body` out of its [cover] if that was "
    "modelled for other rings"
)


def test_the_engine_is_told_before_it_starts_and_the_page_above_all_else(stale):
    from app.ui.page import Page

    engine = build_engine(Setup(robot=str(stale), scene="empty"), ManualClock())
    assert engine.warnings[0] == WORDS
    page = Page(engine, port=0)
    try:
        assert page.blind is not None and "ring1-10 look into forearm_cover" in page.blind.content
    finally:
        page.stop()
    sound = build_engine(Setup(scene="empty"), ManualClock())
    assert blind_words(sound.robot, sound.skin) == ()
    page = Page(sound, port=0)
    try:
        assert page.blind is None
    finally:
        page.stop()


def test_a_headless_run_and_the_doctor_tell_it(stale, capsys):
    args = ["run", "--robot", str(stale), "--scene", "empty", "--headless", "--seconds", "0.1"]
    assert main([*args, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["warnings"] == [WORDS]
    assert main(["doctor", "--robot", str(stale), "--json"]) == 1
    rows = json.loads(capsys.readouterr().out)["rows"]
    told = [r for r in rows if r["name"] == "looks into what it rides on" and not r["ok"]]
    assert [r["subject"] for r in told] == [f"ring1-{i:02d}" for i in range(1, 11)]
    assert "forearm_cover" in told[0]["remedy"]


def test_covers_made_for_the_moved_ring_set_it_free(stale, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    file = stale / "skin/forearm-rings.toml"
    lines = [x for x in file.read_text().splitlines() if not x.startswith(("body", "visual"))]
    file.write_text("\n".join(lines))
    robot = load_robot(stale)
    assert blind_words(robot, load_skin(file, robot)) == ()


def test_the_solid_angle_tells_inside_from_outside_as_trimesh_does():
    from app.robot.blind import _inside
    from app.robot.meshes import BodyMesh

    rng = np.random.default_rng(5)
    mesh = trimesh.creation.annulus(0.05, 0.1, 0.2)
    points = rng.uniform(-0.12, 0.12, (200, 3))
    body = BodyMesh(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64))
    told = [_inside(p, body) for p in points]
    assert told == mesh.contains(points).tolist() and 10 < sum(told) < 190
