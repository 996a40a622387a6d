"""The motion of a calibration is safe, in time, and shows every sensor something near."""

import json
from pathlib import Path

import numpy as np
import pytest

from app.calibration.motion import along
from app.calibration.planes import planes_of
from app.calibration.postures import Planner, travel_time, with_boards
from app.calibration.session import Pace
from app.cli import main
from app.errors import ConfigError
from app.judge.truth import distance_between, surface
from app.robot.model import find_robot, load_robot
from app.robot.skin_file import load_skin
from app.world.scene import find_scene, load_scene
from tests.calibrated_arm import some_of


def test_a_way_ends_where_it_should_and_at_rest() -> None:
    way = np.array([0.3, -1.2, 0.0])
    for speed in (0.2, 0.6, 5.0):
        takes = travel_time(way, speed)
        t = np.linspace(0.0, takes, 4001)
        share = np.array([along(x, way, speed)[0] for x in t])
        rate = np.array([along(x, way, speed)[1] for x in t])
        assert share[0] == 0.0 and share[-1] == pytest.approx(1.0)
        assert np.abs(rate).max() <= speed * (1 + 1e-9)
        np.testing.assert_allclose(rate[[0, -1]], 0.0, atol=1e-6)
        np.testing.assert_allclose(np.gradient(share, t)[1:-1, None] * way, rate[1:-1], atol=2e-2)


def test_nowhere_to_go_takes_no_time() -> None:
    assert travel_time(np.zeros(3), 0.5) == 0.0
    assert along(0.3, np.zeros(3), 0.5)[0] == 0.0


def test_a_plan_is_clear_of_everything_and_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.calibration.postures.CLEAN", 150)
    monkeypatch.setattr("app.calibration.postures.POOL", 40)
    robot = load_robot(find_robot("ur10e"))
    skin = some_of(load_skin(robot.layout, robot), robot, ("ring1-03", "ring2-09"))
    scene = load_scene(find_scene("calibration"))
    planner = Planner(robot, skin, planes_of(scene), with_boards(scene), 0)
    plan = planner.plan(robot.home, 40.0, 0.6, 0.8)
    ways = np.diff(plan.q, axis=0)
    assert len(ways) >= 5
    assert sum(travel_time(w, 0.6) + 0.8 for w in ways) + 0.8 == pytest.approx(plan.seconds)
    assert plan.seconds <= 40.0
    board = next(b for b in scene.bodies if b.movable)
    solid = surface(board.shape.vertices, board.shape.faces)
    forearm = robot.link_index("forearm_link")
    body = robot.bodies[forearm]
    arm = surface(body.vertices, body.faces)
    for a, b in zip(plan.q[:-1], plan.q[1:], strict=True):
        for share in (0.0, 0.25, 0.5, 0.75, 1.0):
            T = robot.posture(a + share * (b - a)).T_base_link[forearm]
            assert distance_between(arm, T, solid, board.motion.pose(0.0)) > 0.02


@pytest.mark.parametrize("pace", [(5.0, 0.6), (300.0, 3.0)])
def test_a_pace_beyond_reason_is_refused(pace: tuple[float, float]) -> None:
    with pytest.raises(ConfigError, match="give"):
        Pace(*pace)


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["live"], "live needs --sensors serial:PORT"),
        (["simulated", "--driver", "ur:1.2.3.4"], "belong to 'live'"),
        (["live", "--sensors", "serial:x", "--driver", "ur:1.2.3.4"], "add --arm"),
        (["nowhere.npz"], "cannot be read"),
        (["simulated", "--scene", "nosuch"], "nosuch"),
    ],
)
def test_what_cannot_be_calibrated_says_why(
    flags: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", "mounts", *flags]) == 1
    assert words in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_writes_all_that_it_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, page, motion = (tmp_path / n for n in ("mounts.toml", "page.html", "motion.npz"))
    asked = ["--out", str(out), "--report", str(page), "--json"]
    flags = ["simulated", "--seconds", "20", "--save", str(motion), *asked]
    assert main(["calibrate", "mounts", *flags]) == 0
    first = json.loads(capsys.readouterr().out)
    assert page.read_text().startswith("<!doctype html>")
    assert main(["calibrate", "mounts", str(motion), *asked]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == first["rows"]
    assert main(["run", "--headless", "--seconds", "0.1", "--mounts", str(out)]) == 0
