"""The panels: what they show of a snapshot, and what they post when a person acts."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from app.actions import (
    AddObstacle,
    DiscardBackground,
    ForgetBackground,
    KeepBackground,
    LearnBackground,
    MoveObstacle,
    SetMode,
    SetParams,
)
from app.config import Params, tunables
from app.messages import Command, GhostState, Mode, Notice, Status, Timing
from app.timing import ManualClock
from app.ui.colours import WARN, css
from app.ui.pacing import HANDS_OFF, Every
from app.ui.page import Page
from app.ui.panels.arm_panel import NOTICE
from app.ui.panels.background_panel import NOTHING, Stage
from app.ui.panels.obstacles_panel import SHAPES, placed
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
    run(page, page.params.controls["distance_kept"], 300.0)
    assert engine.posted == [SetParams({"distance_kept": 0.3})]


def test_a_setting_of_another_window_is_shown_and_not_posted_again(
    page: Page, engine: FakeEngine
) -> None:
    show(page, engine, snapshot(engine, params=Params(distance_kept=0.31, memory=False, mode="sm")))
    assert page.params.controls["distance_kept"].value == pytest.approx(310.0)
    assert page.params.controls["memory"].value is False
    assert "SM" in page.control.control.value
    assert engine.posted == []


def test_a_slider_is_not_pulled_back_while_it_is_moved(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    slider = page.params.controls["separation_margin"]
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
    assert f">{mode.value.capitalize()}<" in page.arm.state.content
    assert "the &lt;reason&gt;" in page.arm.why.content


def test_a_refused_action_is_told(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, notice=Notice("no such body", refused=True)))
    assert ">Refused: no such body<" in page.arm.notice.content


def test_a_success_is_never_told_as_refused(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, notice=Notice("background learned: 255 cells")))
    assert ">background learned: 255 cells<" in page.arm.notice.content
    assert "Refused" not in page.arm.notice.content


def test_a_notice_goes_after_a_while_and_comes_again_when_it_is_said_again(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    notice = Notice("no such body", refused=True)
    show(page, engine, snapshot(engine, notice=notice))
    clock.t += NOTICE - 0.1
    show(page, engine, snapshot(engine, notice=notice))
    assert "no such body" in page.arm.notice.content
    clock.t += 0.2
    show(page, engine, snapshot(engine, notice=notice))
    assert "no such body" not in page.arm.notice.content
    show(page, engine, snapshot(engine, notice=replace(notice)))
    assert "no such body" in page.arm.notice.content


def test_no_notice_hides_the_distance_or_what_holds_the_arm_back(
    page: Page, engine: FakeEngine
) -> None:
    now = snapshot(engine, notice=Notice("no such body", refused=True), advice="blocked: a wall")
    show(page, engine, now)
    assert "Forearm, 25 cm (keeps 25): can give way" in _text(page.arm.closest.content)
    assert "just begun · blocked: a wall" in page.arm.why.content


def test_what_cannot_give_way_is_told_apart_with_the_reason(page: Page, engine: FakeEngine) -> None:
    now = snapshot(engine)
    fixed = replace(now.nearness.yields, link=2, distance=0.09)
    show(page, engine, replace(now, nearness=replace(now.nearness, stays=fixed)))
    assert "Forearm, 25 cm" in _text(page.arm.closest.content)
    assert "Upper arm, 9 cm: can only turn past it" in _text(page.arm.fixed.content)


def test_the_state_is_amber_while_what_can_give_way_is_nearer_than_kept(
    page: Page, engine: FakeEngine
) -> None:
    now = snapshot(engine)
    near = replace(now.nearness, yields=replace(now.nearness.yields, distance=0.20))
    show(page, engine, replace(now, nearness=near))
    assert css(WARN) in page.arm.state.content
    assert "closer than kept" in page.arm.closest.content
    show(page, engine, snapshot(engine))
    assert css(WARN) not in page.arm.state.content


def test_a_slow_computer_is_told_in_the_bar(page: Page, engine: FakeEngine) -> None:
    slow = Timing({}, 0.1, rate=250.0)
    for _ in range(3):  # the snapshots here are a second and a hundred ticks apart
        show(page, engine, snapshot(engine, timing=slow))
    assert "Slow computer: 100 of 250 Hz" in page.arm.notice.content
    show(page, engine, snapshot(engine, timing=slow, notice=Notice("no such body", refused=True)))
    assert "no such body" in page.arm.notice.content
    show(page, engine, snapshot(engine, tick=0))
    assert "Slow computer" not in page.arm.notice.content


def test_run_hold_and_stop_are_posted_with_who_asked(page: Page, engine: FakeEngine) -> None:
    for button in page.arm.buttons:
        run(page, button, True)
    assert [a.mode for a in engine.posted if isinstance(a, SetMode)] == [
        Mode.RUNNING, Mode.HOLDING, Mode.STOPPED,
    ]  # fmt: skip
    assert all(isinstance(a, SetMode) and a.reason.endswith("page 0") for a in engine.posted)


def seen(page: Page, engine: FakeEngine, **background: Any) -> set[str]:
    """Labels of the buttons of the background that are there, after a snapshot."""
    cells = {k: np.zeros((n, 3)) for k, n in background.items() if k != "left"}
    view = replace(NOTHING, left=background.get("left", 0.0), **cells)
    show(page, engine, snapshot(engine, background=view))
    return {b.label for b, _ in page.background._buttons if b.visible}


def test_the_background_is_asked_counted_down_previewed_and_kept(
    page: Page, engine: FakeEngine
) -> None:
    panel = page.background
    assert seen(page, engine) == {"Learn background", "Forget background"}
    assert panel.forget.disabled  # nothing is known
    run(page, panel.learn, True)
    assert seen(page, engine) == {"Cancel", "Begin"} and engine.posted == []
    assert "People must be out of the cell" in panel.text.content
    run(page, panel.begin, True)
    assert engine.posted == [LearnBackground(3.0)]
    assert seen(page, engine, left=2.4) == {"Stop learning"}
    assert "2.4 s to go" in panel.text.content
    assert seen(page, engine, preview=518) == {"Keep", "Discard"}
    assert "518 cells found" in panel.text.content
    run(page, panel.keep, True)
    assert isinstance(engine.posted[-1], KeepBackground)
    assert seen(page, engine, known=518) == {"Learn background", "Forget background"}
    assert "518 cells are known" in panel.text.content and not panel.forget.disabled


def test_learning_and_its_preview_can_be_dropped(page: Page, engine: FakeEngine) -> None:
    for button, state in (
        (page.background.abort, {"left": 1.0}),
        (page.background.discard, {"preview": 3}),
    ):
        seen(page, engine, **state)
        run(page, button, True)
        assert isinstance(engine.posted.pop(), DiscardBackground)
    seen(page, engine)


def test_what_is_known_is_forgotten_only_when_asked_twice(page: Page, engine: FakeEngine) -> None:
    panel = page.background
    seen(page, engine, known=7)
    run(page, panel.forget, True)
    assert seen(page, engine, known=7) == {"Forget all of it", "Cancel"} and engine.posted == []
    run(page, panel.spare, True)
    assert seen(page, engine, known=7) == {"Learn background", "Forget background"}
    run(page, panel.forget, True)
    run(page, panel.forget_all, True)
    assert len(engine.posted) == 1 and isinstance(engine.posted[0], ForgetBackground)
    assert seen(page, engine) == {"Learn background", "Forget background"}


def test_a_second_press_on_the_same_spot_takes_nothing_for_granted(page: Page) -> None:
    """Under `Learn` comes `Cancel`, under `Forget`, the second, `Cancel` as well."""
    panel = page.background
    order = {stage: [b for b, s in panel._buttons if s is stage] for stage in Stage}
    assert order[Stage.IDLE] == [panel.learn, panel.forget]
    assert order[Stage.ASK_LEARN][0] is panel.cancel
    assert order[Stage.ASK_FORGET][1] is panel.spare
    assert order[Stage.LEARNING][0] is panel.abort and order[Stage.PREVIEW][0] is panel.discard


def _text(html: str) -> str:
    """The HTML with the dot before the distance taken away."""
    return re.sub("<span[^>]*>&#9679;</span> ", "", html)


def test_an_engine_that_falls_silent_is_told(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    show(page, engine, snapshot(engine))
    clock.t += 3.0
    assert not page.pump.step()
    assert "No news" in page.arm.state.content
    assert "has not spoken for 3 s" in page.arm.why.content


def test_a_ghost_is_drawn_translucent_with_its_own_distance(page: Page, engine: FakeEngine) -> None:
    links = np.array(snapshot(engine).T_base_link)
    links[:, 0, 3] += 0.1
    ghost = GhostState("qp", links, 0.4, Command(np.zeros(6)))
    command = Command(np.zeros(6), protective=0.37)
    show(page, engine, snapshot(engine, ghost=ghost, command=command))
    assert [h.position[0] for h in page.ghost._links] == pytest.approx(links[:, 0, 3])
    assert all(h.visible for h in page.ghost._links)
    data = page.plot.distance.data
    assert data[5][-1] == pytest.approx(40.0) and data[6][-1] == pytest.approx(37.0)
    show(page, engine, snapshot(engine))
    assert not any(h.visible for h in page.ghost._links)


def test_what_holds_the_arm_back_is_told(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, advice="slow: the sensors are silent for 0.3 s"))
    assert "silent for 0.3 s" in page.arm.why.content


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
