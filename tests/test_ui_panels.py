"""The panels: what they show of a snapshot, and what they post when a person acts."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from app.actions import AddObstacle, MoveObstacle, RunProgram, SetParams, SetPose
from app.config import Params, tunables
from app.messages import Command, GhostState, Mode, Status
from app.timing import ManualClock
from app.ui.pacing import HANDS_OFF, Every
from app.ui.page import Page
from app.ui.panels.obstacles_panel import SHAPES, placed
from app.ui.panels.plot_panel import LENGTH
from app.world.world import World
from tests.ui_page import (  # noqa: F401 - fixtures
    SENSORS,
    FakeEngine,
    at,
    body,
    nobody,
    run,
    show,
    snapshot,
    the_built,
    the_clock,
    the_engine,
    the_page,
)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_new_obstacle_stands_in_front_of_the_tool(engine: FakeEngine, shape: str) -> None:
    now = snapshot(engine)
    add, *rest = placed("new", dict(SHAPES[shape]), now)
    assert isinstance(add, AddObstacle)
    tool = now.T_base_tool[:3, 3]
    assert np.linalg.norm(np.array(add.position)[:2] - tool[:2]) == pytest.approx(0.6)
    assert np.linalg.norm(add.position[:2]) > np.linalg.norm(tool[:2])  # away from the base
    world = World([])
    assert world.add(add.name, add.shape, add.position) == "new"
    for action in rest:
        assert isinstance(action, MoveObstacle)
        world.move(action.name, action.T_base_body)
        thin = action.T_base_body[:3, 2]
        assert thin[2] == pytest.approx(0.0)  # upright


def test_two_new_obstacles_do_not_stand_in_each_other(engine: FakeEngine) -> None:
    (first,) = placed("a", dict(SHAPES["Box"]), snapshot(engine))
    assert isinstance(first, AddObstacle)
    there = (at(body("a"), list(first.position)),)
    (second,) = placed("b", dict(SHAPES["Box"]), snapshot(engine, world=there))
    assert isinstance(second, AddObstacle)
    assert np.linalg.norm(np.subtract(first.position, second.position)) > 0.3


def test_a_setting_of_a_person_is_posted_in_si_units(page: Page, engine: FakeEngine) -> None:
    run(page, page.params.controls["d_min"], 250.0)
    assert engine.posted == [SetParams({"d_min": 0.25})]


def test_a_setting_of_another_window_is_shown_and_not_posted_again(
    page: Page, engine: FakeEngine
) -> None:
    show(page, engine, snapshot(engine, params=Params(d_min=0.31, footprint=False, mode="sm")))
    assert page.params.controls["d_min"].value == pytest.approx(310.0)
    assert page.params.controls["footprint"].value is False
    assert "SM" in page.control.control.value
    assert engine.posted == []


def test_a_slider_is_not_pulled_back_while_it_is_moved(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    slider = page.params.controls["delta"]
    run(page, slider, 150.0)
    show(page, engine, snapshot(engine))
    assert slider.value == 150.0
    clock.t += HANDS_OFF
    show(page, engine, snapshot(engine))
    assert slider.value == pytest.approx(100.0)


def test_every_setting_has_a_control(page: Page) -> None:
    assert set(page.params.controls) | {"mode"} == {t.name for t in tunables()}


@pytest.mark.parametrize("name", [t.name for t in tunables() if t.low is not None])
def test_both_ends_of_every_slider_are_accepted(page: Page, engine: FakeEngine, name: str) -> None:
    control: Any = page.params.controls[name]
    for end in (control.min, control.max):
        run(page, control, end)
        action = engine.posted[-1]
        assert isinstance(action, SetParams)
        replace(Params(), **action.changes)  # raises where a value is refused


def test_the_control_points_are_chosen_by_name(page: Page, engine: FakeEngine) -> None:
    run(page, page.control.control, "Sensor mounts (SM)")
    assert engine.posted == [SetParams({"mode": "sm"})]


@pytest.mark.parametrize("mode", Mode)
def test_the_state_is_told_in_plain_words(page: Page, engine: FakeEngine, mode: Mode) -> None:
    status = Status(mode, "the <reason>", 0.0)
    show(page, engine, snapshot(engine, status=status))
    assert mode.value.capitalize() in page.control.state.content
    assert "the &lt;reason&gt;" in page.control.state.content


def test_a_refused_action_is_told(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, notice="no such body"))
    assert "Refused: no such body" in page.control.state.content


def test_an_engine_that_falls_silent_is_told(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    show(page, engine, snapshot(engine))
    clock.t += 3.0
    assert not page.pump.step()
    assert "has not spoken for 3 s" in page.control.state.content


def test_the_plot_holds_half_a_minute(page: Page, engine: FakeEngine) -> None:
    for _ in range(3):
        show(page, engine, snapshot(engine))
    x, distance, kept, upper, ghost, separation = page.plot.distance.data
    assert len(x) == LENGTH
    assert (x[-1], distance[-1], kept[-1], upper[-1]) == pytest.approx((0.0, 25.0, 25.0, 60.0))
    assert x[-2] == pytest.approx(-1.0)
    assert (ghost < 0.0).all() and (separation < 0.0).all()  # neither is in use
    assert np.isfinite(np.concatenate(page.plot.distance.data)).all()


def test_a_ghost_is_drawn_translucent_with_its_own_distance(page: Page, engine: FakeEngine) -> None:
    links = np.array(snapshot(engine).T_base_link)
    links[:, 0, 3] += 0.1
    ghost = GhostState("qp", links, 0.4, Command(np.zeros(6)))
    command = Command(np.zeros(6), protective=0.37)
    show(page, engine, snapshot(engine, ghost=ghost, command=command))
    assert [h.position[0] for h in page.ghost._links] == pytest.approx(links[:, 0, 3])
    assert all(h.visible for h in page.ghost._links)
    data = page.plot.distance.data
    assert data[4][-1] == pytest.approx(40.0) and data[5][-1] == pytest.approx(37.0)
    show(page, engine, snapshot(engine))
    assert not any(h.visible for h in page.ghost._links)


def test_a_pose_is_typed_and_a_program_is_started_and_ended(page: Page, engine: FakeEngine) -> None:
    page.goals.position.value = (500.0, -100.0, 400.0)
    page.goals.rpy.value = (180.0, 0.0, 90.0)
    run(page, page.goals.go, True)
    assert engine.posted == [SetPose((0.5, -0.1, 0.4), (np.pi, 0.0, np.pi / 2))]
    run(page, page.goals.buttons, "Start")
    run(page, page.goals.buttons, "End")
    assert engine.posted[1:] == [RunProgram("screws"), RunProgram("")]
    show(page, engine, snapshot(engine, program="screws 1/2 left, 0 reached"))
    assert "1/2 left" in page.goals.state.content


def test_what_holds_the_arm_back_is_told(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, advice="slow: the sensors are silent for 0.3 s"))
    assert "silent for 0.3 s" in page.control.state.content


def test_the_plot_draws_an_empty_sky_at_its_top(page: Page, engine: FakeEngine) -> None:
    now = snapshot(engine)
    show(page, engine, replace(now, pairs=nobody(now.pairs)))
    assert page.plot.distance.data[1][-1] == 100.0


def test_the_health_table_counts_the_verdicts(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine))
    text = page.health.table.content
    assert ">no target</td>" in text and f">{64 * SENSORS - 2}</td>" in text
    assert "30 / 30 ms" in text  # ages of the sensors


def test_nothing_is_done_more_often_than_asked() -> None:
    pace = Every(0.25)
    assert [pace.due(t) for t in (0.0, 0.1, 0.24, 0.25, 0.3, 0.1)] == [
        True, False, False, True, False, True,
    ]  # fmt: skip
