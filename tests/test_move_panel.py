"""The tab Move: what it posts when a person acts, and what it says of the arm."""

import asyncio
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.actions import (
    GoHome,
    Jog,
    JogJoints,
    Place,
    RunProgram,
    RunTaught,
    SetGoal,
    SetMode,
    SetParams,
    SetPose,
)
from app.config import Params
from app.control.programs import load_program, program_text, taught
from app.control.reach import Reach, Short
from app.granted import Granted, Wish
from app.messages import Goal, Mode, Status
from app.poses import pose, transform, turns
from app.timing import ManualClock
from app.ui.page import Page
from app.ui.panels.jog_pad import KEYS, viewed
from app.ui.panels.teach_panel import Taught, slug
from tests.ui_page import (  # noqa: F401 - fixtures
    FakeEngine,
    run,
    show,
    snapshot,
    the_built,
    the_clock,
    the_engine,
    the_page,
)

RUNNING = Status(Mode.RUNNING, "started", 0.0)


def hold(page: Page, button: Any, wxyz: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)) -> None:
    """One message of a button that is held in a window with such a camera."""
    camera = SimpleNamespace(wxyz=np.array(wxyz))
    event = SimpleNamespace(
        client_id=0, client=SimpleNamespace(camera=camera), target=button
    )  # fmt: skip
    for callbacks in button._impl.hold_cbs_from_freq.values():
        for callback in callbacks:
            loop = page.server.get_event_loop()
            asyncio.run_coroutine_threadsafe(callback(event), loop).result(5.0)


@pytest.fixture(name="engine", scope="module")
def anew(the_engine: FakeEngine) -> FakeEngine:  # noqa: F811
    return the_engine


def test_a_held_button_asks_for_its_axis_and_one_that_is_let_go_for_nothing(
    page: Page, engine: FakeEngine
) -> None:
    back, ahead = page.move.pad.axes[:2]
    hold(page, back)
    hold(page, ahead)
    run(page, ahead, True)
    shares = [a.share[0] for a in engine.posted if isinstance(a, Jog)]
    assert shares == [-1.0, 1.0, 0.0]
    assert all(np.array_equal(a.R_base_axes, np.eye(3)) for a in engine.posted)
    assert engine.posted[0].reason == "moved by hand at page 0"


def test_every_joint_has_two_buttons_and_every_button_a_key(page: Page, engine: FakeEngine) -> None:
    pad = page.move.pad
    for button in pad.joints:
        hold(page, button)
    shares = np.array([a.share for a in engine.posted if isinstance(a, JogJoints)])
    assert np.array_equal(shares, np.kron(np.eye(6), [[-1.0], [1.0]]))
    assert len(pad.axes) == len(KEYS) == 12
    assert set(pad._keys) == {*KEYS} | {
        f"{shift}Digit{k}" for k in range(1, 7) for shift in ("", "Shift+")
    }
    assert not {"KeyR", "KeyH", "KeyS", "Space", "KeyW", "KeyA", "KeyD", "KeyQ", "KeyE"} & set(
        pad._keys
    )


def test_axes_may_be_the_tools_or_as_a_person_looks(page: Page, engine: FakeEngine) -> None:
    pad = page.move.pad
    run(page, pad.frame, "Tool")
    hold(page, pad.axes[1])
    run(page, pad.frame, "View")
    hold(page, pad.axes[1], (0.5, -0.5, 0.5, -0.5))
    run(page, pad.frame, "Base")
    tool, view = (a for a in engine.posted if isinstance(a, Jog))
    assert tool.R_base_axes is None
    assert view.R_base_axes == pytest.approx(viewed(np.array([0.5, -0.5, 0.5, -0.5])))
    assert np.linalg.det(view.R_base_axes) == pytest.approx(1.0)


def test_a_level_camera_that_looks_along_x_has_left_where_y_is() -> None:
    ahead, down = np.array([1.0, 0, 0]), np.array([0, 0, -1.0])
    R = np.column_stack((np.cross(down, ahead), down, ahead))
    import viser

    axes = viewed(viser.transforms.SO3.from_matrix(R).wxyz)
    assert axes[:, 0] == pytest.approx([0, -1, 0])  # right
    assert axes[:, 1] == pytest.approx([0, 0, 1])  # up
    assert axes[:, 2] == pytest.approx([-1, 0, 0])  # towards the person


def test_speed_is_one_setting_with_its_turning_in_proportion(
    page: Page, engine: FakeEngine, clock: ManualClock
) -> None:
    run(page, page.move.speed, 100.0)
    assert engine.posted == [SetParams({"goal_speed": 0.1, "goal_turning": 0.2})]
    clock.t += 10.0
    show(page, engine, snapshot(engine, params=Params(goal_speed=0.45)))
    assert page.move.speed.value == pytest.approx(450.0)


def test_the_goal_in_numbers_follows_the_goal_until_a_person_types(
    page: Page, engine: FakeEngine
) -> None:
    goal = page.move.goal
    there = Goal(pose([0.6, 0.1, 0.5], [-90.0, 0.0, -80.0]))
    show(page, engine, snapshot(engine, goal=there))
    assert goal.position.value == (600.0, 100.0, 500.0)
    assert goal.rpy.value == pytest.approx((-90.0, 0.0, -80.0))
    run(page, goal.position, (500.0, 100.0, 500.0))
    show(page, engine, snapshot(engine, goal=there))
    assert goal.position.value == (500.0, 100.0, 500.0)
    other = Goal(pose([0.7, 0.1, 0.5], [-90.0, 0.0, -80.0]))
    show(page, engine, snapshot(engine, goal=other))  # dragged by another hand
    assert goal.position.value == (700.0, 100.0, 500.0)


def test_go_there_sends_an_arm_that_holds_and_leaves_one_that_stands(
    page: Page, engine: FakeEngine
) -> None:
    goal, expected = page.move.goal, SetPose((0.5, -0.1, 0.4), (np.pi, 0.0, np.pi / 2))
    for mode, sent in ((Mode.HOLDING, 2), (Mode.RUNNING, 1), (Mode.STOPPED, 1)):
        show(page, engine, snapshot(engine, status=Status(mode, "", 0.0)))
        engine.posted.clear()
        goal.position.value, goal.rpy.value = (500.0, -100.0, 400.0), (180.0, 0.0, 90.0)
        run(page, goal.go, True)
        assert engine.posted[0] == expected and len(engine.posted) == sent
        assert sent == 1 or engine.posted[1] == SetMode(Mode.RUNNING, "sent by a person at page 0")


def test_home_and_the_goal_brought_to_the_tool_are_one_press(
    page: Page, engine: FakeEngine
) -> None:
    now = snapshot(engine, status=RUNNING, goal=Goal(pose([0.6, 0.1, 0.5], [0, 0, 0])))
    show(page, engine, now)
    run(page, page.move.goal.others, "Home")
    run(page, page.move.goal.others, "Goal to tool")
    home, here = engine.posted
    assert home == GoHome() and isinstance(here, SetGoal)
    assert np.array_equal(here.T_base_tool, now.T_base_tool)


def test_where_the_tool_is_and_how_far_it_has_to_go_is_told(page: Page, engine: FakeEngine) -> None:
    T = np.array(snapshot(engine).T_base_tool)
    T[0, 3] += 0.12
    show(page, engine, snapshot(engine, goal=Goal(T)))
    assert "12 cm, 0° to go" in page.move.goal.now.content
    show(page, engine, snapshot(engine))
    assert "at the goal" in page.move.goal.now.content


def test_a_goal_out_of_reach_is_told_how_much_is_missing_and_only_once_it_stays(
    page: Page, engine: FakeEngine
) -> None:
    T = np.array(snapshot(engine).T_base_tool)
    T[:3, 3] = [2.0, 0.0, 0.3]
    show(page, engine, snapshot(engine, goal=Goal(T)))
    assert "cannot" not in page.move.goal.now.content
    show(page, engine, snapshot(engine, goal=Goal(T)))
    assert page.move.goal.asked is not None
    page.move.goal.asked.result(10.0)
    show(page, engine, snapshot(engine, goal=Goal(T)))
    assert "cannot be reached: " in page.move.goal.now.content
    show(page, engine, snapshot(engine))
    assert "cannot" not in page.move.goal.now.content


def test_what_became_of_a_jog_is_told(page: Page, engine: FakeEngine) -> None:
    wish = Wish(twist=np.array([0.3, 0, 0, 0, 0, 0]))
    show(page, engine, snapshot(engine, granted=Granted(wish, 0.4, "wrist 3, 27 cm from it")))
    assert "40 % of what is asked · wrist 3, 27 cm from it" in page.move.told.content
    show(page, engine, snapshot(engine, granted=Granted(wish, -0.1, "")))
    assert "moves the other way" in page.move.told.content
    show(page, engine, snapshot(engine, status=Status(Mode.STOPPED, "", 0.0)))
    assert "press Run or Hold" in page.move.told.content


def test_places_are_taught_ordered_held_and_run(page: Page, engine: FakeEngine) -> None:
    teach = page.move.teach
    first, second = snapshot(engine), snapshot(engine, T_base_tool=pose([0.6, 0, 0.5], [0, 0, 0]))
    for now in (first, second):
        show(page, engine, now)
        run(page, teach.add, True)
    run(page, teach.stay, 1.5)
    run(page, teach.edit, "Earlier")
    run(page, teach.use, "Run")
    (program, go) = engine.posted
    assert isinstance(program, RunTaught) and program.name == "taught"
    assert [p.dwell for p in program.places] == [1.5, 0.0]
    assert np.array_equal(program.places[0].T_base_tool, second.T_base_tool)
    assert go == SetMode(Mode.RUNNING, "sent by a person at page 0")
    assert teach.place.options == ("1: 600 0 500 mm, 1.5 s", f"2: {teach.place.options[1][3:]}")
    run(page, teach.edit, "Delete")
    run(page, teach.edit, "Delete")
    assert teach.place.options == ("(none)",)


def test_a_saved_program_is_read_again_and_never_written_over(
    page: Page, engine: FakeEngine, tmp_path: Path
) -> None:
    teach = page.move.teach
    teach._folder, teach._taught = tmp_path / "programs", Taught()
    show(page, engine, snapshot(engine))
    run(page, teach.add, True)
    teach.name.value = "Door, Left!"
    run(page, teach.use, "Save")
    run(page, teach.use, "Save")
    files = sorted((tmp_path / "programs").iterdir())
    assert [f.name for f in files] == ["door-left-2.toml", "door-left.toml"]
    again = load_program(files[0])
    (place,) = again.waypoints
    assert place.T_base_tool == pytest.approx(snapshot(engine).T_base_tool, abs=1e-5)
    show(page, engine, snapshot(engine))
    assert "flinch run --program" in teach.state.content
    run(page, teach.edit, "Delete")


def test_programs_that_are_there_are_started_and_ended(page: Page, engine: FakeEngine) -> None:
    teach = page.move.teach
    run(page, teach.buttons, "Start")
    run(page, teach.buttons, "End")
    assert engine.posted == [RunProgram("screws"), RunProgram("")]
    show(page, engine, snapshot(engine, program="screws 1/2 left, 0 reached"))
    assert "1/2 left" in teach.state.content


def test_a_taught_program_is_the_same_from_its_file(tmp_path: Path) -> None:
    places = (
        Place(pose([0.5, 0.1, 0.4], [10.0, 20.0, 30.0]), 2.0),
        Place(pose([0.6] * 3, [0] * 3)),
    )
    file = tmp_path / "way.toml"
    file.write_text(program_text("way", places))
    read, made = load_program(file), taught("way", places)
    assert replace(read, waypoints=()).title == made.title and read.speed == made.speed
    for a, b in zip(read.waypoints, made.waypoints, strict=True):
        assert a.dwell == b.dwell and a.name == b.name
        assert a.T_base_tool == pytest.approx(b.T_base_tool, abs=1e-5)
    with pytest.raises(ValueError, match="needs a place"):
        taught("nothing", ())


def test_names_of_files_are_harmless() -> None:
    assert slug("../../etc/passwd") == "etc-passwd" and slug("…") == "taught"


@pytest.mark.parametrize("rpy", [(0.3, -0.4, 2.0), (0.0, np.pi / 2, 0.5), (3.0, 1.2, -3.0)])
def test_turns_are_read_back_from_a_pose(rpy: tuple[float, float, float]) -> None:
    T = transform(np.zeros(3), np.array(rpy))
    assert transform(np.zeros(3), np.array(turns(T))) == pytest.approx(T, abs=1e-9)


def test_reach_finds_what_a_posture_reaches_and_how_much_is_missing(engine: FakeEngine) -> None:
    robot, reach = engine.robot, Reach(engine.robot)
    rng = np.random.default_rng(3)
    for _ in range(10):
        q = rng.uniform(-2.0, 2.0, robot.n)
        assert reach.short(robot.posture(q).T_base_tool, robot.home) == Short(0.0, 0.0)
    T = robot.posture(robot.home).T_base_tool.copy()
    T[:3, 3] = [2.0, 0.0, 0.2]
    far = reach.short(T, robot.home)
    assert 0.5 < far.way < 1.0 and far.words.startswith("cannot be reached: ")
