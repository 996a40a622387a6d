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
from app.ui.traffic import Traffic
from tests.ui_page import (  # noqa: F401 - fixtures
    FakeEngine,
    at,
    body,
    serving,
    show,
    snapshot,
    the_built,
    the_engine,
    the_page,
)


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


def test_a_second_of_an_arm_that_moves_takes_few_messages(page: Page, engine: FakeEngine) -> None:
    """Each message costs the interpreter twice, when it is queued and when it is sent."""
    buffer = page.server._websock_server._broadcast_buffer
    limbs = [body(f"limb {k}", movable=False) for k in range(10)]
    begin = snapshot(engine).stamp
    for k in range(31):
        q = engine.robot.home + 0.01 * k
        posture = engine.robot.posture(q)
        world = tuple(at(limb, [0.5, 0.1 * j, 0.02 * k]) for j, limb in enumerate(limbs))
        moved = snapshot(
            engine, T_base_link=posture.T_base_link, T_base_tool=posture.T_base_tool,
            world=world, stamp=begin + 1000.0 + k / 30.0,
        )  # fmt: skip
        if k == 1:  # from the second on: the first builds the bodies
            first = buffer.message_counter
        show(page, engine, moved)
    # thirty pictures of the arm (13 of its links' places and turns, and the tool's), fifteen of
    # the limbs, and what the panels and the cloud take
    assert buffer.message_counter - first < 30 * 14 + 15 * len(limbs) + 60


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
