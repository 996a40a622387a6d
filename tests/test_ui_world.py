"""Bodies of the simulated world: drawn, rebuilt, dragged with the mouse."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.actions import MoveObstacle
from app.ui.page import Page
from app.ui.scene.world_view import at_height
from tests.ui_page import FakeEngine, at, body, show, snapshot, the_built, the_engine, the_page  # noqa: F401 - fixtures


def test_bodies_appear_move_and_vanish(page: Page, engine: FakeEngine) -> None:
    ball = body("ball")
    show(page, engine, snapshot(engine, world=(at(ball, [1.0, 0.0, 0.0]),)))
    handle = page.server.scene.get_handle_by_name("/world/ball")
    assert handle is not None
    show(page, engine, snapshot(engine, world=(at(ball, [2.0, 0.0, 0.0]),)))
    assert page.server.scene.get_handle_by_name("/world/ball") is handle
    assert handle.position[0] == 2.0
    show(page, engine, snapshot(engine))
    assert page.server.scene.get_handle_by_name("/world/ball") is None


def test_a_body_that_looks_different_is_built_anew(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, world=(at(body("ball"), [1.0, 0.0, 0.0]),)))
    old = page.server.scene.get_handle_by_name("/world/ball")
    show(page, engine, snapshot(engine, world=(at(body("ball", 0.3), [1.0, 0.0, 0.0]),)))
    new: Any = page.server.scene.get_handle_by_name("/world/ball")
    assert new is not old
    assert new.vertices.max() == pytest.approx(0.3)


def pull(page: Page, phase: str, point: list[float], modifier: str | None = None) -> None:
    camera = SimpleNamespace(position=np.array([1.0, -2.0, 2.0]))
    event: Any = SimpleNamespace(
        phase=phase, client_id=1, client=SimpleNamespace(camera=camera), modifier=modifier,
        start_position=tuple(point), end_position=tuple(point),
    )  # fmt: skip
    page.world.drag("ball", event)


def test_a_dragged_body_follows_the_mouse(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, world=(at(body("ball"), [1.0, 0.0, 0.5]),)))
    pull(page, "start", [0.95, 0.0, 0.5])
    pull(page, "update", [0.75, 0.1, 0.7])
    pull(page, "end", [0.75, 0.1, 0.7])
    move = engine.posted[-1]
    assert isinstance(move, MoveObstacle)
    assert move.name == "ball"
    np.testing.assert_allclose(move.T_base_body[:3, 3], [0.8, 0.1, 0.7])


def test_with_shift_a_dragged_body_keeps_its_height(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, world=(at(body("ball"), [1.0, 0.0, 0.5]),)))
    pull(page, "start", [1.0, 0.0, 0.5], "shift")
    pull(page, "update", [0.8, 0.1, 0.9], "shift")
    pull(page, "end", [0.8, 0.1, 0.9], "shift")
    move = engine.posted[-1]
    assert isinstance(move, MoveObstacle)
    assert move.T_base_body[2, 3] == pytest.approx(0.5)
    assert move.T_base_body[0, 3] < 0.8  # the ray goes on behind the point on the screen


def test_a_body_is_not_dragged_out_of_sight(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, world=(at(body("ball"), [1.0, 0.0, 0.5]),)))
    pull(page, "start", [1.0, 0.0, 0.5])
    engine.posted.clear()
    pull(page, "update", [50.0, 0.0, 0.5])
    pull(page, "end", [50.0, 0.0, 0.5])
    assert engine.posted == []


def test_a_level_ray_does_not_move_a_body() -> None:
    eye, point = np.array([0.0, -2.0, 0.5]), np.array([0.0, 0.0, 0.5])
    np.testing.assert_array_equal(at_height(eye, np.array([1.0, 0.0, 0.5]), point), point)
