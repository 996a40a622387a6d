"""A tool on the flange: a body that is kept clear, and the tool frame at its tip."""

import shutil

import numpy as np
import pytest

from app.errors import RobotError
from app.messages import Verdict
from app.perception.proximity import BodyPairs
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.robot.model import find_robot, load_robot
from app.robot.sensor_type import load_sensor_type
from app.robot.skin import Sensor, build_skin
from app.robot.tables import Choice
from app.setup import Setup
from app.studies.headless import run
from tests.fakes import cloud_of

UR10E = find_robot("ur10e")


@pytest.fixture(scope="module")
def armed():
    return load_robot(UR10E, Choice(tool="screwdriver"))


def test_without_being_asked_for_there_is_no_tool(robot):
    assert robot.tool_frame == "tool0" and "screwdriver" not in robot.links
    assert load_robot(UR10E, Choice(tool="none")).links == robot.links


def test_the_tool_frame_moves_to_the_tip(robot, armed):
    q = robot.home + 0.3
    T_flange_tip = np.linalg.inv(robot.posture(q).T_base_tool) @ armed.posture(q).T_base_tool
    expected = np.eye(4)
    expected[2, 3] = 0.200
    assert T_flange_tip == pytest.approx(expected, abs=1e-9)


def test_the_tool_jacobian_is_the_tips(armed):
    rng, h = np.random.default_rng(1), 1e-6
    for _ in range(10):
        q, qd = rng.uniform(-2, 2, armed.n), rng.normal(size=armed.n)
        a, b = armed.posture(q - h * qd).T_base_tool, armed.posture(q + h * qd).T_base_tool
        speed = (b[:3, 3] - a[:3, 3]) / (2 * h)
        assert (armed.posture(q).tool_jacobian() @ qd)[:3] == pytest.approx(speed, abs=1e-6)


def test_the_closest_pairs_know_the_tool(armed):
    posture, tool = armed.posture(armed.home), armed.link_index("screwdriver")
    T = posture.T_base_tool
    beyond = T[:3, :3] @ [0.0, 0.0, 0.05] + T[:3, 3]
    pairs = BodyPairs(armed).update(cloud_of(beyond[None]), posture)
    assert pairs.closest == tool
    assert pairs.distance[tool] == pytest.approx(0.05, abs=1e-6)


def test_the_self_filter_knows_the_tool(armed):
    T = np.eye(4)  # beside the flange, looking along it past the housing
    T[:3, 3] = [0.06, 0.0, 0.0]
    turn = np.radians(-15.0)
    T[0, 0] = T[2, 2] = np.cos(turn)
    T[0, 2], T[2, 0] = np.sin(turn), -np.sin(turn)
    skin = build_skin(
        "one", (Sensor("s", "wrist_3_link", T, load_sensor_type("vl53l8cx"), 0, False),), armed
    )
    posture, rules = armed.posture(armed.home), Rules()
    far = np.full(skin.slots, 4.0)
    judged = SelfFilter(armed, skin).judge(np.array([0]), far, posture, rules)
    link, gap = judged.link, judged.gap
    sees = (link == armed.link_index("screwdriver")) & np.isfinite(gap)
    assert sees.any()
    depth = np.where(sees, 4.0 + gap, 0.05)
    verdict = SelfFilter(armed, skin).judge(np.array([0]), depth, posture, rules).verdict
    assert (verdict[sees] == Verdict.SELF).all()


def test_the_tool_is_shown_and_weighs_on_the_last_joint(robot, armed):
    assert armed.visual("screwdriver").bounds[1][2] == pytest.approx(0.200, abs=1e-3)
    heavier = armed._model.inertias[-1].mass - robot._model.inertias[-1].mass
    assert heavier == pytest.approx(1.2)


def test_an_arm_with_a_tool_runs():
    setup = Setup(scene="side-panel", choice=Choice(tool="screwdriver"))
    record, last = run(setup, 1.0)
    assert record.stops == [] and len(last.body.distance) == len(last.T_base_link) == 9


@pytest.fixture
def copy(tmp_path):
    folder = tmp_path / "arm"
    shutil.copytree(UR10E, folder)
    return folder


TABLE = """
[tool]
name = "driver"
body = "tools/meshes/screwdriver.stl"
mass_kg = 1.2
centre_of_mass_m = [0.0, 0.0, 0.07]
position_m = [0.0, 0.0, 0.2]
rpy_deg = [0.0, 90.0, 0.0]
"""


def test_a_robot_may_have_a_tool_of_its_own_in_a_table_or_by_name(copy):
    file = copy / "robot.toml"
    plain = file.read_text()
    file.write_text(plain + TABLE)
    assert load_robot(copy).tool_frame == "driver_tip"
    assert load_robot(copy, Choice(tool="none")).tool_frame == "tool0"
    for given in ("screwdriver", "tools/screwdriver.toml"):
        file.write_text(f'tool = "{given}"\n{plain}')
        assert load_robot(copy).tool_frame == "screwdriver_tip"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("mass_kg = 1.2", "mass_kg = 0.0", r"screwdriver.toml.*mass_kg"),
        ("mass_kg", "weight", r"screwdriver.toml: unknown key 'weight'; known: body,"),
        ("screwdriver.stl", "none.stl", r"none.stl: the tool's mesh is missing"),
        ("screwdriver.glb", "none.glb", r"none.glb' of link 'screwdriver' is missing"),
        ('name = "screwdriver"', 'name = "tool0"', r"a link 'tool0' already"),
    ],
)
def test_a_broken_tool_is_named_in_one_line(copy, old, new, says):
    file = copy / "tools/screwdriver.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(RobotError, match=says) as error:
        load_robot(copy, Choice(tool="screwdriver"))
    assert "\n" not in str(error.value)


def test_an_unknown_tool_is_answered_with_the_known_ones():
    with pytest.raises(RobotError, match=r"did you mean 'screwdriver'"):
        load_robot(UR10E, Choice(tool="screwdrivr"))
