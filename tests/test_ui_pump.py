"""The pump: each snapshot once, few messages, and a failing view stops the arm."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from app.actions import SetMode
from app.messages import Mode, Snapshot
from app.timing import Latest, ManualClock
from app.ui.page import Page
from app.ui.pump import Pump
from app.ui.server import serving
from app.ui.traffic import Traffic
from tests.ui_page import FakeEngine, show, snapshot, the_built, the_engine, the_page  # noqa: F401 - fixtures


def test_an_old_snapshot_is_not_shown_twice(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine))
    assert not page.pump.step()


def test_a_frame_stays_far_below_one_window_of_messages(page: Page, engine: FakeEngine) -> None:
    """viser sends at most 128 messages in one window of 1/60 s."""
    for k in range(3):
        q = engine.robot.home + 0.01 * k
        posture = engine.robot.posture(q)
        moved = snapshot(engine, T_base_link=posture.T_base_link, T_base_tool=posture.T_base_tool)
        first = page.server._websock_server._broadcast_buffer.message_counter
        show(page, engine, moved)
        last = page.server._websock_server._broadcast_buffer.message_counter
    assert 0 < last - first < 64


def test_a_failing_view_stops_the_arm(engine: FakeEngine) -> None:
    class Broken:
        def update(self, snapshot: Snapshot) -> None:
            raise ZeroDivisionError("a view is broken")

    class Peopled(SimpleNamespace):
        """A server with a window open, which the pump needs to do anything."""

    told: list[tuple[str, str]] = []
    window = SimpleNamespace(add_notification=lambda *text, color: told.append(text))
    fresh = replace(engine, snapshots=Latest(), posted=[])
    fresh.snapshots.put(snapshot(engine), 0.0)
    with serving(port=0) as server:
        peopled: Any = Peopled(atomic=server.atomic, get_clients=lambda: {0: window})
        pump = Pump(peopled, fresh, [Broken()], ManualClock(), Traffic(server), print)
        with pytest.raises(ZeroDivisionError):
            pump._run()
    (stop,) = fresh.posted
    assert isinstance(stop, SetMode)
    assert stop.mode is Mode.STOPPED
    assert stop.reason == "page: ZeroDivisionError: a view is broken"
    assert isinstance(pump.fault, ZeroDivisionError)
    assert told
