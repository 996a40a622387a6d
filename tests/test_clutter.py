"""Narrow places: ours, and MotionBenchMaker's of a UR5 as ones of a UR10e."""

import numpy as np
import pytest

from app.cli import main
from app.errors import ConfigError
from app.judge.truth import TrueDistance
from app.robot.posture import rotation_vector
from app.studies.clutter.moveit import SCALE, flange_of_ur5, load_problem, sets_of
from app.studies.clutter.own import SETS, problem_of
from app.studies.clutter.problem import CLEAR, clearance, inverse, trouble
from app.studies.experiment import experiment_of, run_spec
from app.studies.experiments.clutter import found, outcome
from app.studies.study import Study
from app.studies.trial import TrialResult, TrialSpec

CLUTTER = experiment_of("clutter")
JOINTS = (
    "shoulder_pan_joint shoulder_lift_joint elbow_joint wrist_1_joint wrist_2_joint wrist_3_joint"
)
START, GOAL = (1.57, -1.57, 0.0, -1.57, -1.57, 3.14), (0.3, -1.2, 1.6, -1.9, -1.5, 0.1)


@pytest.fixture(scope="module")
def truth(robot):
    return TrueDistance([(b.vertices, b.faces) for b in robot.bodies])


def write_problem(folder, number, wall=3.0, goal=GOAL):
    """A request, and its scene: a wall ahead of the world's base, and a can of an object's own
    frame."""
    folder.mkdir(exist_ok=True)
    names = JOINTS.split()
    goals = "\n".join(
        f"      - joint_name: {n}\n        position: {q}" for n, q in zip(names, goal, strict=True)
    )
    (folder / f"request{number:04}.yaml").write_text(
        f"start_state:\n  joint_state:\n    name: [{', '.join(names)}, finger]\n"
        f"    position: [{', '.join(map(str, START))}, 0]\n"
        f"goal_constraints:\n  - joint_constraints:\n{goals}\nplanner_id: any\n"
    )
    (folder / f"scene{number:04}.yaml").write_text(
        "name: \"\"\nworld:\n  collision_objects:\n    - id: wall\n"
        "      primitives:\n        - type: box\n          dimensions: [2, 0.1, 3]\n"
        f"      primitive_poses:\n        - position: [0, {wall}, 1]\n"
        "          orientation: [0, 0, 0, 1]\n"
        "    - id: can\n      pose:\n        position: [0, 2, 0.9144]\n"
        "      primitives:\n        - type: cylinder\n          dimensions: [0.2, 0.05]\n"
        "      primitive_poses:\n        - position: [0, 0, 1]\n"
    )  # fmt: skip


def test_both_arms_turn_their_flanges_alike(robot):
    rng = np.random.default_rng(1)
    for q in rng.uniform(-1.5, 1.5, (5, 6)):
        ours, theirs = robot.posture(q).T_base_tool, flange_of_ur5(q)
        assert np.abs(rotation_vector(ours[:3, :3].T @ theirs[:3, :3])).max() < 1e-3
        # its links are longer by a third to a half
        assert np.linalg.norm(ours[:3, 3] - SCALE * theirs[:3, 3]) < 0.12


def test_a_problem_of_a_smaller_arm_is_made_larger_and_is_seen_from_its_base(
    tmp_path, robot, truth
):
    write_problem(tmp_path, 1)
    problem, near = load_problem(tmp_path / "request0001.yaml")
    wall, can = problem.bodies
    # the base of the set looks along the world's y axis, 0.9144 m above the ground
    T = wall.motion.pose(0.0)
    assert T[:3, 3] == pytest.approx(SCALE * np.array([3.0, 0.0, 0.0856]), abs=0.01)
    assert wall.shape.dims == pytest.approx((2 * SCALE, 0.1 * SCALE, 3 * SCALE))
    assert abs(T[0, 1]) == pytest.approx(1.0, abs=1e-3)
    assert can.shape.dims == pytest.approx((0.05 * SCALE, 0.2 * SCALE))
    assert can.motion.pose(0.0)[:3, 3] == pytest.approx(SCALE * np.array([2.0, 0, 1.0]), abs=0.01)
    assert trouble(robot, truth, problem, near) == ""
    q = inverse(robot, problem.T_base_goal, near)
    assert robot.posture(q).T_base_tool == pytest.approx(problem.T_base_goal, abs=1e-4)
    assert np.abs(q - np.array(GOAL)).max() < 0.3


def test_what_is_none_for_the_larger_arm_is_dropped_with_its_reason(tmp_path, robot, truth):
    write_problem(tmp_path, 1, wall=0.5)
    assert found(str(tmp_path), 0)[1] == "the goal is too near"
    result = run_spec(TrialSpec("clutter", f"oracle@{tmp_path}", 0, 0.2))
    assert result.figures["dropped"] == "the goal is too near" and not result.fault
    rows, checks = CLUTTER.tell([result])
    assert rows[0]["dropped"] == 1 and rows[1]["problems"] == "" and not checks[0].ok
    too_high = robot.posture(robot.home).T_base_tool.copy()
    too_high[2, 3] += 2.0
    assert inverse(robot, too_high, robot.home) is None


def test_every_problem_of_ours_has_its_ends_clear_and_is_the_same_again(robot, truth):
    for kind in SETS:
        problem, again = (problem_of(robot, truth, kind, 3) for _ in range(2))
        assert (problem.T_base_goal == again.T_base_goal).all()
        assert [b.name for b in problem.bodies] == [b.name for b in again.bodies]
        assert clearance(robot, truth, problem.start, problem.bodies) >= CLEAR
        assert inverse(robot, problem.T_base_goal, robot.home) is not None


def test_a_folder_stands_for_its_sets_and_ours_for_themselves(tmp_path):
    write_problem(tmp_path / "a", 1)
    write_problem(tmp_path / "b", 2)
    assert [p.name for p in sets_of(tmp_path)] == ["a", "b"] and sets_of(tmp_path / "a")
    names = [s.condition for s in Study("clutter", ("QP", f"WB@{tmp_path}/a"), trials=1).specs()]
    assert names == ["QP@table", "QP@box", "QP@shelf", f"WB@{tmp_path}/a"]
    for wrong in ("QP@drawer", f"QP@{tmp_path}"):
        with pytest.raises(ConfigError, match=r"known: box, shelf, table|no request####\.yaml"):
            CLUTTER.check_condition(wrong)


def test_files_that_are_no_problems_are_told_in_one_line(tmp_path):
    write_problem(tmp_path, 1)
    request, scene = tmp_path / "request0001.yaml", tmp_path / "scene0001.yaml"
    scene.write_text(scene.read_text().replace("type: box", "type: mesh"))
    with pytest.raises(ConfigError, match=r"scene0001\.yaml: .*mesh"):
        load_problem(request)
    scene.write_text("world: {collision_objects: [")
    with pytest.raises(ConfigError, match=r"scene0001\.yaml: cannot be read"):
        load_problem(request)
    request.write_text(request.read_text().replace("elbow", "knee"))
    write_problem(tmp_path, 2)
    scene.write_text((tmp_path / "scene0002.yaml").read_text())
    with pytest.raises(ConfigError, match="no elbow_joint"):
        load_problem(request)


def test_success_contact_and_blocked_are_told_apart():
    def trial(seed, contacts, arrived):
        figures = {"contacts": contacts, "arrived_s": arrived, "own_contacts": contacts,
                   "true_least_m": 0.05, "problem": "p"}  # fmt: skip
        return TrialResult(seed, "QP@box", figures | {"outcome": outcome(figures)})

    trials = [trial(0, 0, 3.0), trial(1, 1, 3.0), trial(2, 0, np.nan), trial(3, 0, 5.0)]
    (row,), checks = CLUTTER.tell(trials)
    assert (row["success"], row["contact"], row["blocked"]) == (0.5, 0.25, 0.25)
    assert row["median_arrived_s"] == 4.0 and row["problems"] == 4 and checks[0].ok


def test_a_moment_in_each_place_has_its_figures():
    result = run_spec(TrialSpec("clutter", "QP@shelf", 1, 0.3))
    assert not result.fault and result.figures["outcome"] == "blocked"
    assert result.figures["goal_error_m"] > 0.1 and result.figures["problem"] == "shelf 1"


@pytest.mark.slow
def test_problems_are_read_from_the_command_line(tmp_path, capsys):
    write_problem(tmp_path, 1)
    command = ["experiment", "clutter", "--problems", str(tmp_path), "--trials", "1"]
    assert main([*command, "--conditions", "oracle", "--seconds", "0.2"]) == 0
    out = capsys.readouterr().out
    assert f"oracle@{tmp_path}" in out and "request0001" in out
