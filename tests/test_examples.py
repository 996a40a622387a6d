"""The examples for others run as they stand, and do what they say."""

import runpy
from types import SimpleNamespace

import numpy as np
import pytest

import flinch
from app.assets import asset_folder

FOLDER = asset_folder("static_assets") / "examples"


def example(name):
    return SimpleNamespace(**runpy.run_path(str(FOLDER / f"{name}.py")))


@pytest.mark.parametrize("name", ["scripted_policy", "lerobot_style"])
def test_an_example_is_read_at_a_glance_and_leans_on_public_names_alone(name):
    text = (FOLDER / f"{name}.py").read_text("utf-8")
    assert len(text.splitlines()) <= 60 and "Limits:" in text
    assert "from app" not in text and "import flinch\n" in text


def test_a_scripted_policy_gives_way_while_something_is_near_and_goes_on_after_it(capsys):
    commands = example("scripted_policy").main(7.0)
    times = 0.01 * np.arange(len(commands))
    free = np.array([c.share > 0.98 for c in commands])
    assert free[(times > 1.0) & (times < 1.5)].all()
    assert not free[(times > 2.5) & (times < 4.5)].any()
    assert free[times > 6.6].all()
    assert "cm from what is in the way" in capsys.readouterr().out


class Follower:
    """A robot of LeRobot's kind, in memory."""

    name = "follower"

    def __init__(self, guard):
        self.keys = [f"{j}.pos" for j in guard.robot.joints]
        self.at = dict(zip(self.keys, guard.robot.home, strict=True))

    def get_observation(self):
        return dict(self.at)

    def send_action(self, action):
        self.at = {k: action[k] for k in self.keys}
        return action


def test_a_robot_of_lerobots_kind_sends_what_keeps_clear_and_returns_it():
    guard = flinch.Guard.of("ur10e")
    robot, now = Follower(guard), [0.0]
    near, rng = [2.0], np.random.default_rng(0)
    wrapped = example("lerobot_style").GuardedRobot(
        robot, guard,
        lambda: [
            guard.frame(s.name, now[0], near[0] * rng.normal(1.0, 0.01, 64))
            for s in guard.skin.sensors
        ],
        lambda: now[0],
    )  # fmt: skip
    assert wrapped.name == "follower"
    key = robot.keys[0]

    def drive(steps):
        for _ in range(steps):
            now[0] += 1.0 / 30.0
            wanted = robot.at[key] + 0.01
            sent = wrapped.send_action({**robot.at, key: wanted, "gripper.pos": 3.0})
        return sent, wanted

    sent, wanted = drive(20)
    assert sent[key] == pytest.approx(wanted, abs=1e-9) and wrapped.reason == ""
    assert sent["gripper.pos"] == 3.0 and robot.at[key] == sent[key]
    near[0] = 0.2
    sent, wanted = drive(15)
    assert abs(sent[key] - wanted) > 1e-3 and wrapped.reason


def test_the_piece_in_the_manual_runs_as_it_stands(monkeypatch, capsys):
    text = (FOLDER.parent / "manual/in-your-own-program.md").read_text("utf-8")
    piece = text.partition("```python\n")[2].partition("```")[0]
    monkeypatch.setattr(flinch.Guard, "warm_up", lambda self: None)  # it takes seconds
    exec(compile(piece, "manual", "exec"), {})
    qd, _, words = capsys.readouterr().out.partition("] ")
    assert qd.startswith("[") and "limits of speed" in words  # it has just begun to move
