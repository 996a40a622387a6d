"""Descriptions as the field has them: followers, foreign names, packages, few joints, units."""

import numpy as np
import pytest
import trimesh

from app.actions import SetGoal
from app.checks.doctor import examine
from app.cli import main
from app.config import Params
from app.errors import RobotError
from app.robot.model import load_urdf
from app.robot.tables import Choice
from app.setup import Setup
from app.studies.headless import run
from app.timing import ManualClock
from app.wiring import build_engine

INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" '
    'iyz="0"/></inertial>'
)
LIMIT = '<limit lower="-3" upper="3" effort="10" velocity="1"/>'


def link(name, inertial=INERTIAL):
    return (
        f'<link name="{name}">{inertial}<collision><origin xyz="0 0 0.2"/><geometry>'
        '<cylinder radius="0.05" length="0.4"/></geometry></collision></link>'
    )


def joint(i, axis="0 1 0", limit=LIMIT, origin='xyz="0 0 0.4"'):
    return (
        f'<joint name="j{i}" type="revolute"><parent link="l{i - 1}"/><child link="l{i}"/>'
        f'<origin {origin}/><axis xyz="{axis}"/>{limit}</joint>'
    )


def arm(joints=3, head='<robot name="arm">', more="", inertial=INERTIAL, **last):
    """A chain of upright cylinders; `last` is what is odd about its last joint."""
    parts = [link("l0", inertial)]
    for i in range(1, joints + 1):
        axis = {"axis": "0 0 1"} if i == 1 else {}
        parts += [link(f"l{i}", inertial), joint(i, **(axis | (last if i == joints else {})))]
    return f"{head}{''.join(parts)}{more}</robot>"


def finger(name, mimic="", axis="0 1 0", kind="prismatic", limit='lower="0" upper="0.2"'):
    return (
        f'<link name="{name}"><collision><geometry><box size="0.02 0.02 0.1"/></geometry>'
        f'</collision></link><joint name="{name}" type="{kind}"><parent link="l3"/>'
        f'<child link="{name}"/><origin xyz="0 0.05 0.4"/><axis xyz="{axis}"/>'
        f'<limit {limit} effort="1" velocity="0.5"/>{mimic}</joint>'
    )


@pytest.fixture
def write(tmp_path):
    def written(text, name="arm.urdf"):
        file = tmp_path / name
        file.write_text(f'<?xml version="1.0"?>{text}')
        return file

    return written


SKIN = (
    'title = "one"\n[[sensor]]\nname = "a"\nlink = "l1"\nposition_m = [0.06, 0.0, 0.2]\n'
    "direction = [1.0, 0.0, 0.0]\nup = [0.0, 0.0, 1.0]\n"
)


def missed(robot):
    return {
        (r["name"], r["subject"]) for r in examine(robot, None).rows if not r["ok"]
    }  # fmt: skip


# --- followers ----------------------------------------------------------------------------


def geared(write):
    back = '<mimic joint="f1" multiplier="-1" offset="0.01"/>'
    bent = '<mimic joint="f2" multiplier="2"/>'
    more = finger("f1") + finger("f2", back) + finger("f3", bent, "1 0 0", "revolute")
    return load_urdf(write(arm(more=more)))


def test_a_follower_begins_where_its_master_has_it_and_follows_followers(write):
    robot = geared(write)
    q = dict(zip(robot.joints, robot.home, strict=True))
    assert q["f1"] == pytest.approx(0.1)
    assert q["f2"] == pytest.approx(0.01 - q["f1"]) and q["f3"] == pytest.approx(2.0 * q["f2"])


def test_rates_of_a_follower_are_its_masters_as_finite_differences_have_them(write):
    robot = geared(write)
    rng = np.random.default_rng(0)
    own = np.flatnonzero(robot.gears.own)
    for _ in range(20):
        q = robot.gears.place(rng.uniform(robot.q_min, robot.q_max))
        links = np.array([robot.links.index(name) for name in ("f1", "f2", "f3", "l2")])
        normals = rng.normal(size=(4, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        here = robot.posture(q)
        points = here.T_base_link[links, :3, 3] + rng.normal(size=(4, 3)) * 0.1
        rows = here.distance_rows(links, points, normals)
        assert not rows[:, ~robot.gears.own].any()
        for j in own:
            step = np.zeros(robot.n)
            step[j] = 1e-6
            there = robot.posture(robot.gears.place(q + step))
            for i, at in enumerate(links):
                T, U = here.T_base_link[at], there.T_base_link[at]
                moved = U @ np.linalg.inv(T) @ np.append(points[i], 1.0)
                rate = normals[i] @ (moved[:3] - points[i]) / 1e-6
                assert rows[i, j] == pytest.approx(rate, abs=1e-5)


def test_a_running_arm_never_breaks_the_relation(write, tmp_path):
    file = geared(write).description.path
    skin = tmp_path / "skin.toml"
    skin.write_text(SKIN)
    for mode in ("qp", "wb"):
        setup = Setup(urdf=str(file), skin=str(skin), scene="empty", choice=Choice(tool="f2"))
        engine = build_engine(setup, ManualClock(), Params(mode=mode))
        s = engine.step()
        T = s.T_base_tool.copy()
        T[:3, 3] += (0.05, 0.08, -0.05)
        engine.post(SetGoal(T))
        gears, begin = engine.robot.gears, s.joints.q
        for _ in range(400):
            s = engine.step()
            assert gears.place(s.joints.q) == pytest.approx(s.joints.q, abs=1e-9)
            assert gears.speed(s.command.qd) == pytest.approx(s.command.qd, abs=1e-12)
        assert np.abs(s.joints.q - begin).max() > 0.01
        engine.stop()


@pytest.mark.parametrize(
    ("mimic", "says"),
    [
        ('<mimic joint="nope"/>', "follows 'nope', which is no moving joint"),
        ('<mimic joint="f1"/>', "follows itself"),
        ('<mimic joint="j1" multiplier="nan"/>', "cannot build it"),
    ],
)
def test_a_mimic_that_means_nothing_is_one_line(write, mimic, says):
    with pytest.raises(RobotError, match=says):
        load_urdf(write(arm(more=finger("f1", mimic))))


# --- names --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        arm(limit=LIMIT.replace("<limit", '<limit drake:acceleration="2"')),
        arm(more='<drake:proximity a:b="1"><link name="x"/></drake:proximity>'),
        arm(head='<robot name="arm" xmlns="http://www.ros.org">'),
        arm(head='<robot name="arm" xmlns:g="urn:g">', more='<g:link name="x"/>'),
        arm(head='<robot name="arm" xmlns:xacro="http://ros.org/wiki/xacro">'),
    ],
)
def test_foreign_names_are_read_over_declared_or_not(write, text):
    robot = load_urdf(write(text))
    assert robot.links == ("l0", "l1", "l2", "l3") and robot.joints == ("j1", "j2", "j3")


@pytest.mark.parametrize("inertial", ["", "<inertial/>", '<inertial><mass value="1"/></inertial>'])
def test_a_missing_inertial_loads_and_the_doctor_tells_of_it(write, inertial, capfd):
    robot = load_urdf(write(arm(inertial=inertial)))
    assert ("mass", "l2") in missed(robot)
    assert capfd.readouterr().err == ""


@pytest.fixture
def packages(tmp_path):
    """Two packages beside each other, one of them under another name."""
    for folder, size in (("arm_description", 0.1), ("checkout-of-gripper", 0.2)):
        (tmp_path / folder / "meshes").mkdir(parents=True)
        trimesh.creation.box((size,) * 3).export(tmp_path / folder / "meshes/base.stl")
    (tmp_path / "arm_description/urdf").mkdir()
    return tmp_path


def with_mesh(packages, name):
    file = packages / "arm_description/urdf/arm.urdf"
    mesh = f'<link name="hand"><collision><geometry><mesh filename="{name}"/></geometry>'
    fixed = '<joint name="f" type="fixed"><parent link="l3"/><child link="hand"/></joint>'
    file.write_text(arm(more=f"{mesh}</collision></link>{fixed}"))
    return np.ptp(load_urdf(file).bodies[-1].vertices[:, 0])


def test_a_package_is_only_the_one_of_that_name(packages):
    for name in (
        "package://arm_description/meshes/base.stl", "model://arm_description/meshes/base.stl",
        "$(find arm_description)/meshes/base.stl", "../meshes/base.stl", "..\\meshes\\base.stl",
    ):  # fmt: skip
        assert with_mesh(packages, name) == pytest.approx(0.1)
    with pytest.raises(RobotError, match=r"missing.*'gripper_description' is looked for above"):
        with_mesh(packages, "package://gripper_description/meshes/base.stl")


def test_a_package_that_is_called_otherwise_is_known_by_its_own_file_or_by_ros(
    packages, monkeypatch
):
    name = "package://gripper_description/meshes/base.stl"
    ros = packages / "elsewhere/share/gripper_description"
    ros.parent.mkdir(parents=True)
    (packages / "checkout-of-gripper").rename(ros)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(packages / "elsewhere"))
    assert with_mesh(packages, name) == pytest.approx(0.2)
    monkeypatch.delenv("AMENT_PREFIX_PATH")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(ros.parent))
    assert with_mesh(packages, name) == pytest.approx(0.2)
    (packages / "arm_description/package.xml").write_text(
        "<package><name>gripper_description</name></package>"
    )
    assert with_mesh(packages, name) == pytest.approx(0.1)


# --- few joints ---------------------------------------------------------------------------


@pytest.mark.parametrize("joints", [1, 2])
def test_an_arm_of_one_or_two_joints_works_everywhere(write, tmp_path, joints, capsys):
    file, skin = write(arm(joints)), tmp_path / "skin.toml"
    skin.write_text(SKIN)
    for mode in ("qp", "ssm", "wb", "sm", "multi", "paper"):
        setup = Setup(urdf=str(file), skin=str(skin), scene="empty")
        record, last = run(setup, 0.2, Params(mode=mode))
        assert not record.stops and len(last.joints.q) == joints
    flags = ("--urdf", str(file), "--skin", str(skin))
    assert main(["doctor", *flags]) == 0
    assert main(["run", "--headless", "--seconds", "0.2", "--scene", "empty", *flags]) == 0
    assert main(["bench", "tick", "--seconds", "0.1", "--scene", "empty", *flags]) in (0, 1)


# --- what the doctor finds ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("odd", "name"),
    [
        ({"axis": "0 0 0"}, "length of a joint's axis"),
        ({"limit": LIMIT.replace('"3"', '"170"')}, "limits of a joint"),
        ({"limit": LIMIT.replace('velocity="1"', 'velocity="180"')}, "velocity limit"),
        ({"origin": 'xyz="0 0 400"'}, "joint from its parent's frame"),
        ({"origin": 'xyz="0 0 0.4" rpy="0 0 90"'}, "turn of a joint's origin"),
    ],
)
def test_the_doctor_finds_axes_of_no_length_degrees_and_millimetres(write, odd, name, capsys):
    file = write(arm(**odd))
    assert missed(load_urdf(file)) == {(name, "j3")}
    assert main(["doctor", "--urdf", str(file)]) == 1


def test_a_quick_small_arm_is_no_false_alarm(write):
    quick = LIMIT.replace('velocity="1"', 'velocity="10.7"')
    assert missed(load_urdf(write(arm(limit=quick)))) == set()


# --- tools of simple shapes ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "low", "high"),
    [
        ("box_m = [0.1, 0.2, 0.3]", (-0.05, -0.1, 0.0), (0.05, 0.1, 0.3)),
        ("cylinder_m = [0.04, 0.2]", (-0.04, -0.04, 0.0), (0.04, 0.04, 0.2)),
        ("sphere_m = 0.05\ncentre_m = [0, 0, 0.2]", (-0.05, -0.05, 0.15), (0.05, 0.05, 0.25)),
    ],
)
def test_a_tool_may_be_a_box_a_cylinder_or_a_ball(tmp_path, write, shape, low, high):
    file = tmp_path / "grip.toml"
    file.write_text(f'name = "grip"\n{shape}\nmass_kg = 0.5\nposition_m = [0, 0, 0.3]\n')
    robot = load_urdf(write(arm()), Choice(tool=str(file)))
    body = robot.bodies[robot.link_index("grip")].vertices
    assert body.min(axis=0) == pytest.approx(low, abs=2e-3)
    assert body.max(axis=0) == pytest.approx(high, abs=2e-3)
    assert robot.tool_frame == "grip_tip"


@pytest.mark.parametrize(
    ("shape", "says"),
    [
        ("", "has no body; give one of body, box_m"),
        ("sphere_m = 0.1\nbox_m = [1, 1, 1]", "has box_m and sphere_m; give one"),
        ('body = "a.stl"', "centre_of_mass_m does not fit a mesh; give it"),
        ("sphere_m = nan", "sphere_m"),
    ],
)
def test_a_tool_without_one_shape_is_one_line(tmp_path, write, shape, says):
    file = tmp_path / "grip.toml"
    file.write_text(f'name = "grip"\n{shape}\nmass_kg = 0.5\nposition_m = [0, 0, 0.3]\n')
    with pytest.raises(RobotError, match=says):
        load_urdf(write(arm()), Choice(tool=str(file)))


def test_home_may_leave_out_the_joints_that_follow(write):
    more = finger("f1") + finger("f2", '<mimic joint="f1" multiplier="-1"/>')
    robot = load_urdf(write(arm(more=more)), Choice(home_deg=(1.0, 2.0, 3.0, 50.0)))
    assert robot.home[3:] == pytest.approx([0.05, -0.05])
