"""Robots that nobody prepared: a bare URDF with its own meshes, of any format and any joints."""

import sys
from types import ModuleType

import numpy as np
import pytest
import trimesh

from app.cli import main
from app.errors import RobotError
from app.robot.descriptions import find_description
from app.robot.model import find_robot, load_robot, load_urdf
from app.robot.sensor_type import load_sensor_type
from app.robot.skin import Sensor, build_skin
from app.robot.tables import Bodies, Choice
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.studies.headless import run
from app.wiring import build_engine
from app.world.world import World

SIZE = (0.08, 0.10, 0.30)  # [m] of every link's box, standing on its frame
JOINTS = {  # of the crane below: type, axis, limit
    "turn": ("continuous", "0 0 1", ""),
    "lift": ("prismatic", "0 0 1", '<limit lower="0" upper="0.4" effort="9" velocity="0.3"/>'),
    "plate": ("fixed", "1 0 0", ""),
    "nod": ("revolute", "0 1 0", '<limit lower="-2" upper="0.5" effort="9" velocity="2"/>'),
    "roll": ("revolute", "1 0 0", '<limit lower="-7" upper="7" effort="9" velocity="2"/>'),
}
MESHES = {  # link after each joint: how its mesh is named in the URDF, and written
    "base": "meshes/base.stl",
    "turn": "package://crane_description/meshes/turn.dae",
    "lift": "meshes/lift.obj",
    "plate": "file://meshes/plate.glb",
    "nod": "meshes/nod.stl",
    "roll": "meshes/roll.stl",
}
XACRO = "<xacro:arm xmlns:xacro='http://wiki.ros.org/xacro'/>"


def box():
    mesh = trimesh.creation.box(SIZE)
    mesh.apply_translation([0.0, 0.0, SIZE[2] / 2])
    return mesh


@pytest.fixture
def crane(tmp_path):
    """base - turn - lift - plate - nod - roll: every kind of joint, every format of mesh."""
    folder = tmp_path / "crane_description"
    (folder / "meshes").mkdir(parents=True)
    links, joints, parent = [], [], ""
    for link, mesh in MESHES.items():
        box().export(folder / "meshes" / mesh.rsplit("/", 1)[1])
        shape = f'<geometry><mesh filename="{mesh}"/></geometry>'
        links.append(
            f'<link name="{link}_link"><visual>{shape}</visual>'
            f"<collision>{shape}</collision></link>"
        )
        if parent:
            kind, axis, limit = JOINTS[link]
            joints.append(
                f'<joint name="{link}" type="{kind}"><parent link="{parent}_link"/>'
                f'<child link="{link}_link"/><origin xyz="0 0 0.3"/>'
                f'<axis xyz="{axis}"/>{limit}</joint>'
            )
        parent = link
    # a shorter branch must not be taken for the arm
    links.append('<link name="camera"/>')
    joints.append(
        '<joint name="eye" type="fixed"><parent link="base_link"/><child link="camera"/></joint>'
    )
    file = folder / "crane.urdf"
    file.write_text(f'<robot name="crane">{"".join(links)}{"".join(joints)}</robot>')
    return file


def edit(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def test_a_bare_urdf_gets_defaults_for_all_that_it_cannot_say(crane):
    robot = load_urdf(crane)
    assert robot.name == "crane" and robot.skin is None
    assert robot.joints == ("turn", "lift", "nod", "roll")
    assert robot.tool_frame == "roll_link"
    assert robot.q_min == pytest.approx([-2 * np.pi, 0.0, -2.0, -7.0])
    assert robot.q_max == pytest.approx([2 * np.pi, 0.4, 0.5, 7.0])
    assert robot.home == pytest.approx([0.0, 0.2, -0.75, 0.0])
    assert robot.qd_max == pytest.approx([1.0, 0.3, 2.0, 2.0])
    assert robot.qdd_max == pytest.approx([6.0, 2.0, 6.0, 6.0])
    assert robot.links == tuple(f"{name}_link" for name in MESHES)


def test_a_joint_without_a_velocity_limit_is_told(crane, caplog):
    load_urdf(crane)
    assert [r.getMessage() for r in caplog.records] == [
        "crane.urdf: joint turn has no usable velocity limit; 1 a second is assumed"
    ]


def test_a_mesh_is_the_same_in_every_format(crane):
    robot = load_urdf(crane)
    for link in robot.links:
        body = robot.bodies[robot.link_index(link)]
        shown = robot.visual(link)
        for low, high in (shown.bounds, (body.vertices.min(axis=0), body.vertices.max(axis=0))):
            assert low == pytest.approx([-0.04, -0.05, 0.0], abs=1e-6)
            assert high == pytest.approx([0.04, 0.05, 0.30], abs=1e-6)


def test_a_collada_file_in_millimetres_is_scaled_to_metres(crane):
    file = crane.parent / "meshes/turn.dae"
    mesh = box()
    mesh.apply_scale(1000.0)
    mesh.export(file)
    assert load_urdf(crane).bodies[1].vertices.max() == pytest.approx(300.0)
    edit(file, "<asset>", '<asset><unit name="millimeter" meter="0.001"/>')
    assert load_urdf(crane).bodies[1].vertices.max() == pytest.approx(0.3)


def test_links_on_one_side_of_a_fixed_joint_are_welded(crane):
    robot = load_urdf(crane)
    pairs = np.argwhere(np.triu(robot.welded, 1)).tolist()
    assert pairs == [[robot.link_index("lift_link"), robot.link_index("plate_link")]]


def test_jacobians_of_sliding_and_turning_joints_agree_with_finite_differences(crane):
    robot, rng, h = load_urdf(crane), np.random.default_rng(1), 1e-6
    for _ in range(20):
        q, qd = rng.uniform(robot.q_min, robot.q_max), rng.normal(size=robot.n)
        a, b = robot.posture(q - h * qd).T_base_tool, robot.posture(q + h * qd).T_base_tool
        linear = (b[:3, 3] - a[:3, 3]) / (2 * h)
        assert (robot.posture(q).tool_jacobian() @ qd)[:3] == pytest.approx(linear, abs=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("meshes/nod.stl", "meshes/none.stl", r"'meshes/none.stl' of link 'nod_link' is missing"),
        ("crane_description/meshes", "cran/mashes", r"'package://cran/mashes/turn.dae'.*missing"),
        ('type="prismatic"', 'type="planar"', r"joint 'lift' has . degrees of freedom"),
        ('lower="-2" upper="0.5"', 'lower="1" upper="1"', r"joint 'nod' has the limits 1 to 1"),
        ("<robot name", "<machine name", r"not a readable URDF"),
        ('<link name="camera"/>', XACRO, r"expand them first"),
    ],
)  # fmt: skip
def test_what_cannot_be_an_arm_is_named_in_one_line(crane, old, new, says):
    edit(crane, old, new)
    with pytest.raises(RobotError, match=says) as error:
        load_urdf(crane)
    assert "\n" not in str(error.value)


def test_a_missing_visual_mesh_stops_too_since_no_link_may_be_invisible(crane):
    text = crane.read_text()
    at = text.index("meshes/nod.stl")
    crane.write_text(text[:at] + "meshes/gone.stl" + text[at + len("meshes/nod.stl") :])
    with pytest.raises(RobotError, match=r"gone.stl.*nod_link.*missing"):
        load_urdf(crane)


def test_a_link_that_is_only_visible_stops_unless_distances_go_to_the_visual_meshes(crane):
    edit(
        crane,
        '<collision><geometry><mesh filename="meshes/nod.stl"/></geometry></collision>',
        "",
    )
    with pytest.raises(RobotError, match=r"'nod_link' has no collision mesh.*--bodies visual"):
        load_urdf(crane)
    robot = load_urdf(crane, Choice(bodies="visual"))
    assert "nod_link" in robot.links


def test_a_link_without_a_visual_mesh_is_shown_by_its_collision_mesh(crane):
    edit(crane, '<visual><geometry><mesh filename="meshes/nod.stl"/></geometry></visual>', "")
    assert load_urdf(crane).visual("nod_link").bounds[1][2] == pytest.approx(0.3)


def test_home_and_tool_frame_can_be_given(crane):
    robot = load_urdf(crane, Choice(tool="nod_link", home_deg=(90.0, 100.0, -45.0, 10.0)))
    assert robot.tool_frame == "nod_link"
    assert robot.home == pytest.approx([np.pi / 2, 0.1, -np.pi / 4, np.radians(10)])
    with pytest.raises(RobotError, match=r"home_deg has 1 values, the arm has 4 joints"):
        load_urdf(crane, Choice(home_deg=(90.0,)))
    with pytest.raises(RobotError, match=r"outside the limits of lift"):
        load_urdf(crane, Choice(home_deg=(0.0, 500.0, 0.0, 0.0)))
    with pytest.raises(RobotError, match=r"did you mean 'nod_link'"):
        load_urdf(crane, Choice(tool="not_link"))


SKIN = """title = "one ring"
[[ring]]
name = "r"
link = "nod_link"
centre_m = [0.0, 0.0, 0.2]
axis = [0.0, 0.0, 1.0]
start = [1.0, 0.0, 0.0]
radius_m = 0.08
count = 6
"""


@pytest.mark.parametrize("bodies", ["collision", "visual"])
@pytest.mark.parametrize("mode", ["wb", "sm"])
def test_a_bare_urdf_runs_with_a_skin_given_for_it(crane, mode, bodies: Bodies):
    from app.config import Params

    skin = crane.parent / "skin.toml"
    skin.write_text(SKIN)
    setup = Setup(urdf=str(crane), skin=str(skin), scene="approach", choice=Choice(bodies=bodies))
    record, last = run(setup, 0.6, Params(mode=mode))
    assert record.stops == [] and last.joints.q.shape == (4,)
    assert record.overspeed <= 0 and record.overreach <= 0


def test_a_bare_urdf_without_a_skin_is_asked_for_one(crane, capsys):
    assert main(["run", "--urdf", str(crane), "--headless"]) == 1
    assert "choose a layout with --skin" in capsys.readouterr().err


def test_a_scene_begins_in_its_own_posture_only_with_the_robot_it_was_made_for(crane):
    skin = crane.parent / "skin.toml"
    skin.write_text(SKIN)
    from app.timing import ManualClock

    ours = build_engine(Setup(scene="approach"), ManualClock()).step()
    assert np.degrees(ours.joints.q[1]) == pytest.approx(-90.0, abs=1.0)
    other = Setup(scene="approach", urdf=str(crane), skin=str(skin))
    assert build_engine(other, ManualClock()).step().joints.q[1] == pytest.approx(0.2, abs=0.01)
    asked = Setup(scene="approach", choice=Choice(home_deg=(10.0, -70.0, 80.0, 0.0, 0.0, 0.0)))
    q = build_engine(asked, ManualClock()).step().joints.q
    assert np.degrees(q[:2]) == pytest.approx([10.0, -70.0], abs=1.0)


# --- descriptions that are fetched --------------------------------------------------------


def collection(monkeypatch, **modules):
    monkeypatch.setitem(sys.modules, "robot_descriptions", ModuleType("robot_descriptions"))
    for name, facts in modules.items():
        module = ModuleType(name)
        vars(module).update(facts)
        monkeypatch.setitem(sys.modules, f"robot_descriptions.{name}", module)


def test_a_public_description_is_loaded_by_name(crane, monkeypatch):
    from app.choices import build_robot

    collection(monkeypatch, crane_description={"URDF_PATH": str(crane)})
    robot = build_robot(Setup(robot="robot_descriptions:crane_description"))
    assert robot.name == "crane" and robot.n == 4


def test_an_unknown_description_or_one_without_urdf_is_one_line(monkeypatch):
    collection(monkeypatch, only_mjcf={"MJCF_PATH": "x.xml"})
    with pytest.raises(RobotError, match=r"only_mjcf is no URDF"):
        find_description("only_mjcf")
    with pytest.raises(RobotError, match=r"has no 'nobody'; list them"):
        find_description("nobody")


def test_without_the_extra_the_command_that_installs_it_is_told(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "robot_descriptions", None)
    assert main(["run", "--robot", "robot_descriptions:x", "--headless"]) == 1
    assert "pip install 'flinch[descriptions]'" in capsys.readouterr().err


def test_the_built_in_robot_is_never_changed_by_a_choice():
    plain = load_robot(find_robot("ur10e"))
    flange = load_robot(find_robot("ur10e"), Choice(tool="flange"))
    assert (plain.tool_frame, flange.tool_frame) == ("tool0", "flange")
    assert plain.links == flange.links


def test_a_sensor_sees_what_is_bolted_to_its_link_where_it_is(crane):
    robot = load_urdf(crane)
    T = np.eye(4)
    T[:3, :3] = np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]])  # z: back to the link's axis
    T[:3, 3] = [0.5, 0.0, 0.45]  # before the middle of the plate, which stands on the lift
    skin = build_skin(
        "back", (Sensor("back", "lift_link", T, load_sensor_type("vl53l8cx"), 0, False),), robot
    )
    eye = SimulatedSkin(robot, skin, World(()), 0, ErrorModel(ideal=True))
    label = eye.read(0, robot.posture(robot.home)).label.reshape(8, 8)
    assert (label[3:5, 3:5] == robot.link_index("plate_link")).all()
