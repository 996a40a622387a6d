"""An arm of one's own: a URDF becomes a robot folder that is examined, run and gives way."""

import json
import re
import shutil
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import trimesh

from app.cli import Run, main
from app.cli.bench import Bench
from app.cli.calibrate.filter import CalibrateFilter
from app.cli.calibrate.mounts import CalibrateMounts
from app.cli.calibrate.ranges import CalibrateRanges
from app.cli.doctor import Doctor
from app.cli.kernels import Kernels
from app.cli.skin import SkinCheck, SkinEmulate
from app.cli.which import WhichRobot
from app.config import Params
from app.errors import RobotError
from app.robot.draft import Wish, parse_wish, write_draft
from app.robot.model import find_robot, load_robot
from app.robot.skin_file import load_skin
from app.robot.tables import Choice
from app.setup import Setup

TEMPLATE = find_robot("template")
WISHES = (Wish("seg3", 8), Wish("seg5", 8))
CYLINDER = re.compile(r'<cylinder radius="([\d.]+)" length="([\d.]+)"/>')


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """A cache of the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def primitives(tmp_path):
    """A URDF of seven joints without a mesh."""
    return shutil.copy(TEMPLATE / "template.urdf", tmp_path / "arm.urdf")


@pytest.fixture
def meshes(tmp_path):
    """The same arm as files of several formats, some with others beside them."""
    folder = tmp_path / "arm_description"
    (folder / "visual").mkdir(parents=True)
    count = iter(range(100))

    def as_mesh(match):
        n = next(count)
        name = f"visual/part{n}.{('stl', 'obj', 'dae', 'glb')[n % 4]}"
        trimesh.creation.cylinder(*map(float, match.groups()), sections=40).export(folder / name)
        prefix = "package://arm_description/" if n % 2 else ""
        return f'<mesh filename="{prefix}{name}"/>'

    text = CYLINDER.sub(as_mesh, (TEMPLATE / "template.urdf").read_text())
    (folder / "visual/part1.obj").write_text(
        "mtllib paint.mtl\n" + (folder / "visual/part1.obj").read_text()
    )
    (folder / "visual/paint.mtl").write_text("newmtl red\nmap_Kd ../pictures/red.png\n")
    (folder / "pictures").mkdir()
    (folder / "pictures/red.png").write_bytes(b"red")
    file = folder / "arm.urdf"
    file.write_text(text)
    return file


def files(folder):
    return {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}


def test_the_template_is_what_the_command_writes(tmp_path):
    write_draft(TEMPLATE / "template.urdf", WISHES, tmp_path / "new")
    assert files(tmp_path / "new") == files(TEMPLATE)
    for name in files(TEMPLATE):
        assert (tmp_path / "new" / name).read_bytes() == (TEMPLATE / name).read_bytes(), name


@pytest.mark.parametrize("kind", [pytest.param("primitives", marks=pytest.mark.slow), "meshes"])
def test_an_arm_of_seven_joints_works_the_whole_way(kind, request, tmp_path, capsys):
    urdf, out = request.getfixturevalue(kind), str(tmp_path / "mine")
    assert main(["new-robot", str(urdf), "--ring", "seg3:8", "--ring", "seg5:6", "--out", out]) == 0
    assert "7 joints" in capsys.readouterr().out
    shutil.rmtree(tmp_path / "arm_description", ignore_errors=True)  # the folder is whole

    assert main(["doctor", "--robot", out, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [c for c in report["checks"] if not c["ok"]] == []

    scene = tmp_path / "scene.toml"
    robot = load_robot(tmp_path / "mine")
    skin = load_skin(robot.layout, robot)
    posture = robot.posture(robot.home)
    T = posture.T_base_link[skin.link[0]]
    ahead = T[:3, :3] @ (skin.origin[0] + 0.22 * skin.axis[0]) + T[:3, 3]
    scene.write_text(SCENE.format(ahead.tolist()))
    args = ["run", "--robot", out, "--scene", str(scene), "--headless", "--seconds", "2", "--json"]
    assert main(args) == 0
    row = json.loads(capsys.readouterr().out)["rows"][0]
    assert row["warnings"] == [] and row["stops"] == []
    assert row["min_perceived_distance_m"] < 0.2  # seen
    assert row["avoiding_share"] > 0.5  # and given way to

    from app.studies.headless import run

    record, _ = run(Setup(robot=out, scene=str(scene)), 3.0, Params())
    assert record.steady(1.0) > record.true_distance[0] + 0.02


SCENE = """title = "a ball beside the third link"
[[body]]
name = "ball"
shape = {{ kind = "sphere", radius_m = 0.06 }}
position_m = {}
"""


def test_meshes_are_copied_with_what_they_name_and_the_urdf_keeps_its_comments(meshes, tmp_path):
    write_draft(meshes, WISHES, tmp_path / "mine")
    inside = files(tmp_path / "mine")
    assert {"meshes/visual/part1.obj", "meshes/visual/paint.mtl"} <= inside
    assert "meshes/pictures/red.png" in inside
    text = (tmp_path / "mine/arm.urdf").read_text()
    assert "No such arm" in text and "package://" not in text and "meshes/visual/part0.stl" in text


def test_two_rings_of_one_link_share_its_length_and_stand_half_a_pitch_apart(primitives, tmp_path):
    _, rings = write_draft(primitives, [Wish("seg2", 8), Wish("seg2", 8)], tmp_path / "mine")
    assert [r.name for r in rings] == ["seg2-1", "seg2-2"]
    assert rings[0].centre[2] < rings[1].centre[2]
    assert rings[0].start @ rings[1].start == pytest.approx(np.cos(np.pi / 8))
    for r in rings:
        assert r.axis == pytest.approx([0.0, 0.0, 1.0])
        assert r.radius == pytest.approx(0.055 + 0.0173, abs=1e-3)


def test_rings_that_would_overlap_are_refused(primitives, tmp_path):
    with pytest.raises(RobotError, match=r"round for 180 mm, which has room for 3 rings"):
        write_draft(primitives, [Wish("seg3", 8)] * 4, tmp_path / "mine")


def test_rings_go_round_the_visual_meshes_where_the_collision_meshes_are_hulls(
    primitives, tmp_path
):
    urdf = tmp_path / "hulls.urdf"
    text = Path(primitives).read_text()
    tube = '<collision><origin xyz="0 0 0.100"/><geometry><cylinder radius="0.050" length="0.180"/>'
    assert tube in text
    hull = '<collision><origin xyz="0 0 0.100"/><geometry><box size="0.16 0.14 0.18"/>'
    urdf.write_text(text.replace(tube, hull))
    with pytest.raises(RobotError, match=r"'seg3' is not round.*add --bodies visual"):
        write_draft(urdf, WISHES, tmp_path / "mine")
    write_draft(urdf, WISHES, tmp_path / "mine", "visual")
    robot = load_robot(tmp_path / "mine")
    assert robot.description.bodies == "visual"
    assert np.ptp(robot.bodies[robot.link_index("seg3")].vertices[:, 0]) == pytest.approx(0.1)
    assert load_robot(tmp_path / "mine", Choice(bodies="collision", skin="none")).n == 7


def test_the_tool_can_go_anywhere_from_the_home_that_is_found(primitives, tmp_path):
    robot, _ = write_draft(primitives, WISHES, tmp_path / "mine")
    straight = np.linalg.svd(robot.posture(np.zeros(7)).tool_jacobian()[:3])[1][-1]
    bent = np.linalg.svd(robot.posture(robot.home).tool_jacobian()[:3])[1][-1]
    assert straight < 1e-6 and bent > 0.1


@pytest.mark.parametrize(
    ("ring", "says"),
    [
        ("seg33:8", r"no link 'seg33'; did you mean 'seg3'\? known: seg1, seg2"),
        ("base:8", r"'base' is fixed to the base.*known: seg1"),
        ("tool0:8", r"'tool0' has no shape"),
        ("seg7:8", r"'seg7' is not round for 46 mm anywhere.*known: seg1, seg2, seg3, seg4, seg5"),
        ("seg3:0", r"'seg3:0'; give LINK:COUNT"),
        ("seg3", r"'seg3'; give LINK:COUNT"),
        ("seg3:90", r"90 windows do not fit"),
    ],
)
def test_a_ring_that_cannot_be_is_one_line_and_nothing_is_written(
    ring, says, primitives, tmp_path, capsys
):
    out = tmp_path / "mine"
    assert main(["new-robot", str(primitives), "--ring", ring, "--out", str(out)]) == 1
    told = capsys.readouterr().err
    assert re.search(says, told) and told.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir() if p.name != "cache"] == ["arm.urdf"]


def test_a_missing_mesh_no_ring_and_a_folder_that_is_there_are_one_line(meshes, tmp_path):
    with pytest.raises(RobotError, match=r"give --ring LINK:COUNT"):
        write_draft(meshes, [], tmp_path / "mine")
    (tmp_path / "mine").mkdir()
    with pytest.raises(RobotError, match=r"is there already; give another --out"):
        write_draft(meshes, WISHES, tmp_path / "mine")
    (meshes.parent / "visual/part4.stl").unlink()
    with pytest.raises(RobotError, match=r"part4.stl' of link 'seg\d' is missing"):
        write_draft(meshes, WISHES, tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_a_wish_is_read_from_the_right():
    assert parse_wish("a:b:12") == Wish("a:b", 12)


CALIBRATIONS = (CalibrateFilter, CalibrateMounts, CalibrateRanges)
COMMANDS = (Run, Doctor, Bench, Kernels, *CALIBRATIONS, SkinCheck, SkinEmulate)


def test_every_command_that_takes_a_robot_takes_it_by_the_same_flags():
    own = {f.name for f in fields(WhichRobot)}
    for command in COMMANDS:
        assert issubclass(command, WhichRobot), command
        assert own <= {f.name for f in fields(command)}


@pytest.mark.parametrize(
    "command",
    [
        ("doctor",),
        ("skin", "check"),
        ("skin", "emulate", "--seconds", "0.3", "--scene", "empty", "--link"),
        ("run", "--headless", "--seconds", "0.1", "--scene", "empty"),
    ],
    ids=" ".join,
)
def test_a_command_takes_a_bare_urdf_as_it_takes_a_folder(command, primitives, tmp_path, capsys):
    write_draft(primitives, WISHES, tmp_path / "mine")
    capsys.readouterr()
    link = [str(tmp_path / "port")] if command[-1] == "--link" else []
    layout = str(tmp_path / "mine/skin/rings.toml")
    assert main([*command, *link, "--robot", str(tmp_path / "mine")]) == 0
    folder = capsys.readouterr().out
    assert main([*command, *link, "--urdf", str(primitives), "--skin", layout]) == 0
    bare = capsys.readouterr().out
    assert folder and first_words(folder) == first_words(bare)


def first_words(text):
    """The first two words of every line: figures of another posture differ."""
    return [line.split()[:2] for line in text.splitlines() if "frames" not in line]
