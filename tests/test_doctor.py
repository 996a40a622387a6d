"""The doctor finds what is wrong with a robot folder, and says how to mend it."""

import json
import shutil

import numpy as np
import pytest
import trimesh

from app.checks.doctor import examine, to_table
from app.cli import main
from app.robot.model import find_robot, load_robot
from app.robot.skin_file import load_skin
from app.robot.tables import Choice


def checkup(folder, layout="forearm-rings", tool=""):
    robot = load_robot(folder, Choice(tool=tool, skin=layout))
    return examine(robot, load_skin(robot.folder / f"skin/{layout}.toml", robot))


def missed(report):
    """Check -> subjects that miss it."""
    found = {}
    for row in report.rows:
        if not row["ok"]:
            found.setdefault(row["name"], []).append(row["subject"])
            assert row["remedy"]
    assert sorted(found) == sorted(c.name for c in report.checks if not c.ok)
    return found


@pytest.mark.parametrize(
    ("name", "layout", "tool"),
    [
        ("ur10e", "forearm-rings", "screwdriver"),
        ("ur10e", "sparse-4x4", ""),
        ("ur10e", "placed-30", ""),
        ("swan7", "two-rings", ""),
    ],
)
def test_the_built_in_robots_are_sound(name, layout, tool):
    report = checkup(find_robot(name), layout, tool)
    assert missed(report) == {}
    assert len(report.checks) == 21
    assert to_table(report).endswith("sound")


@pytest.fixture
def copy(tmp_path):
    folder = tmp_path / "arm"
    shutil.copytree(find_robot("ur10e"), folder)
    return folder


def edit(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


SHOULDER = 'ixx="0.03408" ixy="2e-05" ixz="-0.00425" iyy="0.03529"'
CASES = [
    ("ur10e.urdf", '<mass value="2.1"/>', '<mass value="0"/>', {"mass": ["wrist_1_link"]}),
    (
        "ur10e.urdf",
        SHOULDER,
        SHOULDER.replace("0.03408", "0.3408"),
        {"triangle inequality of inertias": ["shoulder_link"]},
    ),
    (
        "ur10e.urdf",
        'effort="150" velocity="3.141592653589793"',
        'effort="150" velocity="180"',
        {"velocity limit": ["elbow_joint"]},
    ),
    (
        "robot.toml",
        "110.0, -100.0",
        "179.5, -100.0",
        {"home within its limits": ["elbow_joint"]},
    ),
]


@pytest.mark.parametrize(("file", "old", "new", "expected"), CASES)
def test_a_wrong_number_is_found_where_it_is(copy, file, old, new, expected):
    edit(copy / file, old, new)
    found = missed(checkup(copy))
    assert {k: v for k, v in found.items() if k != "links apart at home"} == expected


def test_a_tensor_that_is_not_positive_definite_is_found(copy):
    edit(copy / "ur10e.urdf", 'iyy="0.00041"', 'iyy="-0.00041"')
    assert missed(checkup(copy))["smallest principal inertia"] == ["wrist_3_link"]


def test_a_hole_in_a_mesh_is_found(copy):
    file = copy / "meshes/body/wrist_2_link.stl"
    mesh = trimesh.load(file, force="mesh")
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    mesh.export(file)
    assert missed(checkup(copy)) == {"open edges of a body": ["wrist_2_link"]}


def test_a_link_with_a_shape_that_is_left_out_is_found(copy):
    links = [x for x in load_robot(copy, Choice(skin="none")).links if x != "wrist_2_link"]
    edit(copy / "robot.toml", "skin =", f"links = {links}\nskin =")
    assert missed(checkup(copy)) == {"shapes left out": ["wrist_2_link"]}


def test_too_many_faces_are_found_link_by_link_and_in_all(copy):
    for link in ("upper_arm_link", "forearm_link"):
        file = copy / f"meshes/body/{link}.stl"
        trimesh.load(file, force="mesh").subdivide().export(file)
    found = missed(checkup(copy))
    assert found["faces of a body"] == ["upper_arm_link", "forearm_link"]
    assert found["faces of all bodies"] == ["ur10e"]


def test_a_mesh_in_millimetres_is_found(copy):
    file = copy / "meshes/body/wrist_3_link.stl"
    mesh = trimesh.load(file, force="mesh")
    mesh.apply_scale(1000.0)
    mesh.export(file)
    report = checkup(copy)
    assert missed(report)["largest size of a body"] == ["wrist_3_link"]
    assert "export in metres" in to_table(report)


def test_a_ring_inside_the_covers_is_found_with_the_zones_that_it_loses(copy):
    file = copy / "skin/forearm-rings.toml"
    text = file.read_text()
    first = text.index("radius_m = 0.060")
    file.write_text(text[:first] + "radius_m = 0.050" + text[first + 16 :])
    found = missed(checkup(copy))
    ring = [f"ring1-{i:02d}" for i in range(1, 11)]
    assert found == {
        "lens before every body": ring,
        "zones that see what they ride on": ring,
        "looks into what it rides on": ring,
    }


def test_an_arm_that_is_in_its_own_way_at_home_is_found(copy):
    edit(copy / "robot.toml", "[0.0, -100.0, 110.0, -100.0,", "[0.0, -25.0, 168.0, 22.0,")
    found = missed(checkup(copy))
    assert "upper_arm_link and wrist_1_link" in found["links apart at home"]


def test_a_mesh_far_from_its_frame_is_found(copy):
    edit(
        copy / "ur10e.urdf",
        '<geometry><mesh filename="meshes/body/wrist_1_link.stl"/></geometry>',
        '<origin xyz="0 0 1"/><geometry><mesh filename="meshes/body/wrist_1_link.stl"/></geometry>',
    )
    assert missed(checkup(copy))["link frame from its body"] == ["wrist_1_link"]


def test_the_command_prints_a_table_with_remedies_and_ends_with_one(copy, capsys):
    edit(copy / "ur10e.urdf", '<mass value="2.1"/>', '<mass value="0"/>')
    assert main(["doctor", str(copy)]) == 1
    out = capsys.readouterr().out
    assert "MISSED 1 of" in out and "wrist_1_link: 0 kg; give its <inertial>" in out


def test_the_command_prints_json_in_the_common_form(capsys):
    assert main(["doctor", "swan7", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert list(content) == ["what", "machine", "versions", "seed", "rows", "checks"]
    assert content["what"] == "doctor" and all(c["ok"] for c in content["checks"])
    assert all({"name", "value", "unit", "limit", "ok"} == set(c) for c in content["checks"])


def test_a_folder_that_cannot_be_read_is_one_line(copy, capsys):
    (copy / "meshes/visual/wrist_1_link.glb").unlink()
    assert main(["doctor", str(copy)]) == 1
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and "wrist_1_link.glb" in err
