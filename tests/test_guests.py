"""Others' controllers: a file with a class that acts is a mode like any other, or is named."""

import json

import numpy as np
import pytest

from app.brain import Brain
from app.cell.parts import Cell
from app.cli import main
from app.config import Params
from app.control.clearance import Clearance
from app.control.controller import Situation
from app.control.guests.files import guest_digest, is_guest, tells_row, welcome
from app.control.registry import forget, kind_of, kinds
from app.errors import ConfigError, FlinchError
from app.messages import Goal, JointState
from app.perception.proximity import BodyPairs
from app.studies.case import Case, run_case, setup_of
from app.studies.conditions import read_condition
from app.studies.trial import TrialSpec

BLIND = '''
"""To the goal, whatever is there."""
import numpy as np

class Blind:
    def __init__(self, arm):
        self.arm = arm

    def act(self, frames, joints, goal):
        posture = self.arm.posture(joints.q)
        J = posture.tool_jacobian()
        twist = self.arm.twist(goal, posture)
        return J.T @ np.linalg.solve(J @ J.T + 1e-3 * np.eye(6), twist)
'''


@pytest.fixture(autouse=True)
def no_guest_stays():
    yield
    for name in [n for n in kinds() if is_guest(n)]:
        forget(name)


@pytest.fixture
def guest(tmp_path):
    """Writes a file and gives its name."""

    def write(text, file="mine.py", kind=""):
        path = tmp_path / file
        path.write_text(text)
        return f"{path}:{kind}" if kind else str(path)

    return write


def acting(body, head="pass", more=""):
    return (
        f"import numpy as np\nclass Mine:\n    def __init__(self, arm):\n        self.arm = arm\n"
        f"        {head}\n    def act(self, frames, joints, goal):\n        {body}\n{more}"
    )


def told(robot, point=(0.6, 0.17, 0.4), applied=None):
    """What a controller is told with one point of the world before it."""
    posture = robot.posture(robot.home)
    pairs = BodyPairs(robot).search(np.array([point]), np.ones(1, dtype=bool), posture)
    rest = np.zeros(robot.n) if applied is None else applied
    joints = JointState(0.0, robot.home, np.zeros(robot.n))
    return Situation(posture, joints, pairs, Goal(posture.T_base_tool), Params(), 0.008, 1.0, rest)


def made(robot, name):
    return kind_of(welcome(name)).make(robot, Clearance(robot, Cell()))


def trial(name, scene="front-panel", seconds=1.0):
    spec = TrialSpec("a scene", name, 0, seconds)
    condition = read_condition(name, sides=False)
    return run_case(spec, condition, Case(setup_of(spec, condition, scene), condition.params()))


def test_what_it_asks_for_is_cut_to_the_limits_and_the_cut_is_told(robot, guest):
    name = guest(acting("return np.full(self.arm.n, 1e3)"))
    command = made(robot, name).update(told(robot))
    assert (np.abs(command.qd) <= robot.qdd_max * 0.008 + 1e-12).all() and command.qd.max() > 0.0
    assert command.progress < 0.01 and command.control_row == -1
    slow = made(robot, guest(acting("return np.full(6, 1e-3)"))).update(told(robot))
    assert slow.progress == 1.0 and slow.qd == pytest.approx(1e-3)


def test_it_is_told_the_nearest_pairs_first_and_the_points_of_the_world(robot, guest):
    body = (
        "near = frames.near; rows = self.arm.rows(near, self.arm.posture(joints.q));"
        " assert (np.diff(near.distance) >= 0).all() and rows.shape == (len(near.link), 6);"
        " assert frames.points.shape[1] == 3 and goal.shape == (4, 4);"
        " self.row = 0; return rows[0] * 0.01"
    )
    now = told(robot)
    command = made(robot, guest(acting(body))).update(now)
    assert command.control_row == int(np.argmin(now.pairs.distance))
    assert command.qd @ now.posture.distance_rows(
        now.pairs.link[[command.control_row]], now.pairs.on_robot[[command.control_row]],
        now.pairs.normal[[command.control_row]],
    )[0] > 0.0  # fmt: skip


def test_points_are_what_perception_believes_and_raw_frames_are_the_sensors_own(guest):
    body = (
        "n = len(frames.raw);"
        " z = [self.arm.zones(f, self.arm.posture(joints.q)) for f in frames.raw];"
        " far = frames.points[:, 0] > 0.8 if len(frames.points) else np.ones(1);"
        " assert joints.stamp < 0.3 or (n == 30 and len(frames.points) > 20 and far.any());"
        " assert all(p.shape == (64, 3) for p in z); return np.zeros(6)"
    )
    assert trial(guest(acting(body)), seconds=0.5).figures["stops"] == 0


def test_what_it_does_to_what_it_was_told_is_its_own_affair(robot, guest):
    now = told(robot)
    goal = now.goal.T_base_tool.copy()
    made(robot, guest(acting("goal[:] = 0; joints.q[:] = 9; return joints.q * 0"))).update(now)
    assert (now.goal.T_base_tool == goal).all() and (now.joints.q == robot.home).all()


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("return np.zeros(5)", r"act gave the shape \(5,\); give 6 joint velocities"),
        ("return None", "act gave"),
        ("return 'fast'", "act gave a str; give 6 joint velocities"),
        ("return np.full(6, np.nan)", "give finite velocities"),
        ("return 1 / 0", r"act raised ZeroDivisionError\(.*\), line 7 of mine.py"),
        ("raise SystemExit", "act raised SystemExit"),
    ],
)
def test_what_is_no_velocity_stops_the_arm_by_name(robot, guest, body, words):
    name = guest(acting(body))
    with pytest.raises(FlinchError, match=words) as stopped:
        made(robot, name).update(told(robot))
    assert str(stopped.value).startswith(name)


def test_one_that_cannot_be_made_is_named_and_the_others_drive_on(robot, guest):
    name = guest(acting("return np.zeros(6)", head="raise ValueError('no weights')"))
    with pytest.raises(FlinchError, match=r"__init__ raised ValueError.*no weights"):
        made(robot, name).update(told(robot))
    assert trial("WB", seconds=0.2).figures["stops"] == 0


def test_its_reset_is_called_before_it_acts_again(robot, guest):
    more = "    def reset(self):\n        self.arm.was = getattr(self.arm, 'was', 0) + 1\n"
    name = guest(acting("return np.full(6, getattr(self.arm, 'was', 0) * 1e-3)", more=more))
    control = made(robot, name)
    assert not control.update(told(robot)).qd.any()
    control.reset()
    control.reset()
    assert control.update(told(robot)).qd == pytest.approx(1e-3)


@pytest.mark.parametrize(
    ("text", "kind", "words"),
    [
        (acting("pass"), "Mien", "no class 'Mien'; did you mean 'Mine'"),
        ("class Mine:\n    pass\n", "Mine", "class Mine has no act"),
        ("x = 1\n", "", "has no class with an act"),
        (acting("pass") + acting("pass").replace("Mine", "Other"), "", "classes Mine, Other"),
        ("class Mine\n", "", "line 1: SyntaxError"),
        ("import nothing_of_this_name\n", "", "line 1: ModuleNotFoundError"),
    ],
)
def test_a_file_without_a_controller_is_refused_in_one_line(guest, text, kind, words):
    name = guest(text, kind=kind)
    with pytest.raises(ConfigError, match=words) as refused:
        read_condition(name, sides=False)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there_is_told_with_those_that_are_shipped():
    with pytest.raises(ConfigError, match=r"no file 'potential.py'.*did you mean 'potential_f"):
        welcome("potential.py")


def test_a_changed_file_is_another_guest(robot, guest):
    name = guest(acting("return np.zeros(6)"))
    before = guest_digest(welcome(name))
    guest(acting("return np.full(6, 1e-3)"))
    assert guest_digest(name) != before
    assert made(robot, name).update(told(robot)).qd == pytest.approx(1e-3)


def test_it_is_a_condition_with_sides_and_changes_whatever_its_file_is_called(guest):
    name = guest(acting("return np.zeros(6)"), file="my-own+best.py", kind="Mine")
    c = read_condition(f"{name}L-memory+dead:3")
    assert (c.mode, c.side, c.fault, c.failing) == (name, "left", "dead", 3)
    assert not c.params().memory and read_condition(f"{name} alone").mode == name
    with pytest.raises(ConfigError, match="end its controller with R or L"):
        read_condition(name.replace(":Mine", ""))
    assert is_guest(name) and not is_guest("QP") and not tells_row(name)
    assert tells_row("potential_field.py")


def test_the_potential_field_stays_away_from_a_plate_that_a_blind_one_runs_into(guest):
    field, blind = trial("potential_field.py", seconds=4.0), trial(guest(BLIND), seconds=4.0)
    assert field.figures["true_least_m"] > 0.2 > blind.figures["true_least_m"]
    assert field.figures["stops"] == blind.figures["stops"] == 0
    assert field.figures["jumps_per_s"] >= 0.0 and field.figures["effort"] > 0.0


@pytest.mark.peers
def test_pink_drives_the_arm_and_stays_away():
    pytest.importorskip("pink")
    figures = trial("pink_spheres.py", seconds=4.0).figures
    assert figures["stops"] == 0 and figures["true_least_m"] > 0.2 and figures["effort"] > 0.0


def test_the_state_of_a_brain_leaves_a_guest_alone(robot, skin, guest):
    name = welcome(guest(acting("return np.zeros(6)", head="self.odd = object()")))
    brain = Brain(robot, skin, params=Params(mode=name))
    made_of = brain._controllers._by_mode[name]
    made_of.update(told(robot))  # it is there now, with what no state can read
    state = brain.capture()
    brain.restore(state)
    assert brain.digest() == brain.digest()


def test_it_leads_a_run_from_the_command_line_but_no_real_arm(guest, capsys):
    name = guest(BLIND)
    command = ["run", "--headless", "--seconds", "0.5", "--scene", "front-panel", "--json"]
    assert main([*command, "--controller", name]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["mode"] == name
    assert main(["run", "--controller", name, "--driver", "ur:127.0.0.1"]) == 1
    assert "leads a simulated arm" in capsys.readouterr().err
