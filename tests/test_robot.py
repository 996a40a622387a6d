"""The robot folder, its kinematics and every Jacobian, against finite differences."""

import pickle
import shutil
from io import BytesIO

import numpy as np
import pytest
import trimesh

from app.errors import RobotError
from app.messages import JointState
from app.robot.history import JointHistory
from app.robot.model import find_robot, load_robot
from app.robot.posture import rigid


def random_q(robot, rng):
    return rng.uniform(-np.pi, np.pi, robot.n)


def test_the_row_of_a_distance_agrees_with_finite_differences_on_every_link(robot):
    rng = np.random.default_rng(1)
    worst = 0.0
    for _ in range(40):
        q, qd, h = random_q(robot, rng), rng.normal(size=robot.n), 1e-6
        p = robot.posture(q)
        before, after = robot.posture(q - h * qd), robot.posture(q + h * qd)
        for link in range(len(robot.links)):
            point_link = rng.uniform(-0.3, 0.3, 3)
            T = p.T_base_link[link]
            point = T[:3, :3] @ point_link + T[:3, 3]
            world = point + rng.normal(size=3)
            normal = (point - world) / np.linalg.norm(point - world)
            distance = [
                np.linalg.norm(k.T_base_link[link][:3, :3] @ point_link
                               + k.T_base_link[link][:3, 3] - world)
                for k in (before, after)
            ]  # fmt: skip
            rate = p.distance_rows(np.array([link]), point[None], normal[None])[0] @ qd
            worst = max(worst, abs(rate - (distance[1] - distance[0]) / (2 * h)))
    assert worst < 1e-6


def test_the_tool_jacobian_agrees_with_finite_differences(robot):
    rng = np.random.default_rng(2)
    for _ in range(40):
        q, qd, h = random_q(robot, rng), rng.normal(size=robot.n), 1e-6
        J = robot.posture(q).tool_jacobian()
        a, b = robot.posture(q - h * qd).T_base_tool, robot.posture(q + h * qd).T_base_tool
        linear = (b[:3, 3] - a[:3, 3]) / (2 * h)
        spin = (b[:3, :3] - a[:3, :3]) / (2 * h) @ robot.posture(q).T_base_tool[:3, :3].T
        angular = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        assert np.allclose(J @ qd, np.concatenate([linear, angular]), atol=1e-6)


def test_joints_beyond_a_link_do_not_move_it(robot):
    cover = robot.link_index("forearm_cover")
    assert np.array_equal(robot.supports[cover], robot.supports[cover - 1])
    seven = np.delete(robot.supports, cover, axis=0)
    assert seven.tolist() == np.tril(np.ones((7, 6)), -1).tolist()


def test_only_the_covers_are_welded_to_another_link(robot):
    forearm, cover = robot.link_index("forearm_link"), robot.link_index("forearm_cover")
    apart = robot.welded & ~np.eye(len(robot.links), dtype=bool)
    assert np.argwhere(apart).tolist() == [[forearm, cover], [cover, forearm]]


def test_a_posture_is_read_only(robot):
    with pytest.raises(ValueError, match="read-only"):
        robot.posture(robot.home).T_base_link[0, 0, 0] = 1.0


def test_history_interpolates_between_states_and_clamps_outside():
    history = JointHistory(1, length=4)
    for t in range(6):  # more than it holds
        history.append(JointState(float(t), np.array([10.0 * t]), np.zeros(1)))
    assert history.at(4.25)[0] == pytest.approx(42.5)
    assert history.at(99.0)[0] == 50.0
    assert history.at(0.0)[0] == 20.0


def test_history_without_a_state_says_so():
    with pytest.raises(LookupError):
        JointHistory(6).at(0.0)


def test_rigid_refuses_what_is_not_finite_and_mends_what_is_nearly_a_pose():
    with pytest.raises(ValueError, match="finite"):
        rigid(np.full((4, 4), np.nan))
    T = np.eye(4)
    T[:3, :3] *= 1.01
    assert np.allclose(rigid(T), np.eye(4))


def test_an_unknown_robot_is_answered_with_the_known_ones():
    with pytest.raises(RobotError, match=r"'ur10' .*known: .*ur10e"):
        find_robot("ur10")


@pytest.fixture
def copy(tmp_path):
    folder = tmp_path / "arm"
    shutil.copytree(find_robot("ur10e"), folder)
    return folder


def edit(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


@pytest.mark.parametrize(
    ("file", "old", "new", "says"),
    [
        ("robot.toml", 'name = "ur10e"', "name = ", r"not valid TOML"),
        ("robot.toml", "title", "titel", r"robot.toml: .*titel"),
        ("robot.toml", "-90.0, 0.0]", "-90.0]", r"home_deg has 5 values, the arm has 6"),
        ("robot.toml", "110.0", "200.0", r"outside the limits of elbow_joint"),
        ("robot.toml", '"tool0"', '"tool9"', r"no link 'tool9'.*tool0"),
        ("robot.toml", '"ur10e.urdf"', '"none.urdf"', r"'none.urdf' does not exist"),
        ("ur10e.urdf", "<robot", "<rob", r"not a readable URDF"),
        ("ur10e.urdf", "body/forearm_link.stl", "body/no.stl", r"no.stl.*forearm_link.*missing"),
    ],
)  # fmt: skip
def test_a_broken_robot_folder_is_named_in_one_line(copy, file, old, new, says):
    edit(copy / file, old, new)
    with pytest.raises(RobotError, match=says) as error:
        load_robot(copy)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["ur10e", "swan7"])
def test_what_the_page_is_sent_keeps_the_files_normals_and_is_at_most_3_megabytes(name):
    robot, total = load_robot(find_robot(name)), 0
    for link in robot.links:
        sent = robot.visual(link).export(file_type="glb")
        total += len(sent)
        name = "skin_cover" if link == "forearm_cover" else link
        made = trimesh.load_scene(robot.folder / f"meshes/visual/{name}.glb")
        came = trimesh.load_scene(BytesIO(sent), file_type="glb")
        left = list(came.geometry.values())
        for m in made.geometry.values():
            same = [s for s in left if np.array_equal(s.vertices, m.vertices)]
            assert any(np.allclose(s.vertex_normals, m.vertex_normals, atol=1e-5) for s in same)
        assert len(left) == len(made.geometry)
    assert total <= 3_000_000


def test_an_empty_mesh_file_is_named(copy):
    (copy / "meshes/body/wrist_1_link.stl").write_bytes(b"")
    with pytest.raises(RobotError, match=r"wrist_1_link\.stl"):
        load_robot(copy)


def test_a_posture_asked_for_again_is_the_one_of_its_joints_however_many_came_between(robot):
    rng = np.random.default_rng(12)
    places = robot.home + rng.uniform(-0.5, 0.5, (80, robot.n))
    first = [robot.posture(q).T_base_tool for q in places]
    assert robot.posture(places[-2]) is robot.posture(places[-2].copy())
    assert len({T.tobytes() for T in first}) == len(places)
    for q, T in zip(places, first, strict=True):
        assert np.array_equal(robot.posture(q).T_base_tool, T)


def test_a_copied_robot_has_kinematics_of_its_own(robot):
    q, other = robot.home + 0.1, robot.home - 0.2
    robot.posture(q)
    copy = pickle.loads(pickle.dumps(robot))
    expected = robot.posture(other).T_base_link
    robot.posture(q + 0.05)  # the scratch space that the copy must not look at
    assert np.array_equal(copy.posture(other).T_base_link, expected)
