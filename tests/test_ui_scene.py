"""What the scene shows: links, sensors, clouds, arrows, the goal's handle."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser

from app.actions import SetGoal
from app.colours import activation_colour
from app.messages import SensorHealth, Verdict
from app.near import Nearness
from app.timing import ManualClock
from app.ui.colours import ALARM, CALM, HEALTH, NEAR, POINT
from app.ui.pacing import HANDS_OFF
from app.ui.page import Page
from app.ui.scene.cloud_view import WORDS, parked
from tests.ui_page import (  # noqa: F401 - fixtures
    SENSORS,
    FakeEngine,
    at,
    body,
    cloud,
    nobody,
    run,
    show,
    snapshot,
    the_built,
    the_clock,
    the_engine,
    the_page,
)


def test_links_go_where_the_snapshot_says(page: Page, engine: FakeEngine) -> None:
    q = engine.robot.home + 0.3
    posture = engine.robot.posture(q)
    show(page, engine, snapshot(engine, T_base_link=posture.T_base_link))
    for link, T in zip(engine.robot.links, posture.T_base_link, strict=True):
        handle = page.server.scene.get_handle_by_name(f"/robot/{link}")
        assert handle is not None
        np.testing.assert_allclose(handle.position, T[:3, 3], atol=1e-6)
        R = viser.transforms.SO3(handle.wxyz).as_matrix()
        np.testing.assert_allclose(R, T[:3, :3], atol=1e-6)


def test_a_sensor_is_coloured_by_its_health(page: Page, engine: FakeEngine) -> None:
    health = np.array([SensorHealth.POOR, SensorHealth.STALE], dtype=np.uint8)
    show(page, engine, snapshot(engine, health=health))
    (patch,) = page.robot.patches  # both sit on one link
    shown = [tuple(colour) for colour in patch.handle.batched_colors]
    assert shown == [HEALTH[SensorHealth(h)] for h in health]


def test_only_kept_points_are_shown_at_first(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine))
    seen = {v for v in POINT if cloud(page, v.name.lower()).visible}
    assert seen == {Verdict.KEPT}


def test_a_switched_on_class_shows_its_points(page: Page, engine: FakeEngine) -> None:
    box = page.switches.boxes[WORDS[Verdict.SELF][0]]
    run(page, box, True)
    show(page, engine, snapshot(engine))
    own = cloud(page, "self")
    assert own.visible
    np.testing.assert_allclose(np.unique(own.points, axis=0), [[0.5, 0.1, 0.6]], atol=1e-6)
    run(page, box, False)
    show(page, engine, snapshot(engine))
    assert not own.visible


def test_a_cloud_keeps_its_count_whatever_is_seen(page: Page, engine: FakeEngine) -> None:
    now = snapshot(engine)
    show(page, engine, now)
    before = cloud(page, "kept").points.shape
    verdict = now.cloud.verdict.copy()
    verdict[[3, 70]] = Verdict.KEPT
    show(page, engine, snapshot(engine, cloud=replace(now.cloud, verdict=verdict)))
    assert cloud(page, "kept").points.shape == before == (64 * SENSORS, 3)


def test_an_empty_class_is_hidden(page: Page, engine: FakeEngine) -> None:
    now = snapshot(engine)
    unseen = replace(now.cloud, points=np.full_like(now.cloud.points, np.nan))
    show(page, engine, replace(now, cloud=unseen))
    assert not cloud(page, "kept").visible


def test_empty_slots_are_parked_on_a_point_of_the_class() -> None:
    points = np.array([[np.nan] * 3, [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    out = parked(points, np.array([False, False, True]))
    assert out.dtype == np.float32
    np.testing.assert_array_equal(out, [[4.0, 5.0, 6.0]] * 3)


def test_the_arrow_leads_from_the_world_to_the_robot(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine))
    np.testing.assert_allclose(page.pair.arrow.points[0], [[1.0, 0.0, 0.5], [0.75, 0.0, 0.5]])
    assert page.pair.label.text == "25 cm · forearm"
    assert tuple(page.pair.arrow.colors) == NEAR  # the avoidance acts, and keeps what it promises
    assert not page.pair.fixed.visible  # nothing else is near
    assert page.pair.arrow.visible and page.pair.label.visible


def test_no_arrow_without_a_point(page: Page, engine: FakeEngine) -> None:
    now = snapshot(engine)
    none = nobody(now.pairs)
    show(page, engine, replace(now, pairs=none, body=none, nearness=Nearness()))
    assert not page.pair.arrow.visible and not page.pair.label.visible


def test_link_arrows_of_unseen_links_repeat_the_closest(page: Page, engine: FakeEngine) -> None:
    run(page, page.switches.boxes["Link arrows"], True)
    show(page, engine, snapshot(engine))
    assert page.pair.others.visible
    assert np.isfinite(page.pair.others.points).all()
    assert len(page.pair.others.points) == len(engine.robot.links)
    run(page, page.switches.boxes["Link arrows"], False)


def test_activation_goes_from_calm_to_alarm() -> None:
    assert activation_colour(0.0) == CALM
    assert activation_colour(1.0) == activation_colour(1.3) == ALARM
    assert len({activation_colour(a) for a in np.linspace(0, 1, 101)}) == 5


def test_ground_lies_below_the_lowest_fixed_body(page: Page, engine: FakeEngine) -> None:
    low = body("floor", 0.1, movable=False)
    show(page, engine, snapshot(engine, world=(at(low, [0.0, 0.0, -0.8]),)))
    ground = page.server.scene.get_handle_by_name("/ground")
    assert ground is not None
    assert ground.position[2] == pytest.approx(-0.8 - 0.1 - 0.002)


def drag_goal(page: Page, engine: FakeEngine, phase: str, x: float) -> None:
    page.goal.handle._impl.position[:] = [x, 0.0, 0.5]
    event: Any = SimpleNamespace(target=page.goal.handle, phase=phase, client_id=7)
    page.goal.moved(event, engine)


def test_a_dragged_goal_is_posted_and_not_pulled_back(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    drag_goal(page, engine, "start", 0.6)
    drag_goal(page, engine, "update", 0.7)
    clock.t += 60.0  # a slow hand
    show(page, engine, snapshot(engine))
    assert page.goal.handle.position[0] == pytest.approx(0.7)
    (goal,) = engine.posted
    assert isinstance(goal, SetGoal)
    np.testing.assert_allclose(goal.T_base_tool[:3, 3], [0.7, 0.0, 0.5])


def test_a_released_goal_follows_the_arm_again(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    drag_goal(page, engine, "start", 0.8)
    drag_goal(page, engine, "end", 0.8)
    now = snapshot(engine)
    show(page, engine, now)
    assert page.goal.handle.position[0] == pytest.approx(0.8)
    clock.t += HANDS_OFF
    show(page, engine, snapshot(engine))
    np.testing.assert_allclose(page.goal.handle.position, now.goal.T_base_tool[:3, 3])
