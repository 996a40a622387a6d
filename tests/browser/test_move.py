"""A person moves the arm by hand: with the mouse on a button, with a key, and lets go."""

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import Live
from hands import READY, until
from playwright.sync_api import Page as Window

from app.messages import Mode, Snapshot
from app.ui.inside import uuid_of

pytestmark = pytest.mark.browser


@pytest.fixture(autouse=True)
def moved(live: Live, window: Window, light: None, small: None) -> Iterator[None]:
    """On the tab, in a small window without the heavy part of the scene."""
    window.get_by_role("tab", name="Move").click()
    yield
    window.keyboard.up("u")
    window.mouse.up()


def up(live: Live, window: Window) -> tuple[float, float]:
    """The middle of the button that raises the tool."""
    button = next(b for b in live.page.move.pad.axes if b.label == "+z")
    found = window.locator(f"[id='{uuid_of(button)}']")
    found.scroll_into_view_if_needed()
    box = found.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2.0, box["y"] + box["height"] / 2.0


def height(live: Live) -> float:
    return float(live.now.T_base_tool[2, 3])


def rests(live: Live) -> bool:
    now: Snapshot = live.now
    return now.granted is None and bool(np.abs(now.joints.qd).max() < 0.01)


def stays(live: Live, window: Window) -> None:
    """It holds where it was left."""
    until(window, lambda: rests(live), "the arm has come to rest")
    there = height(live)
    window.wait_for_timeout(300)
    assert height(live) == pytest.approx(there, abs=0.003)
    assert live.now.status.mode is Mode.HOLDING
    assert live.now.status.reason == "moved by hand at page 1"


def test_a_button_that_is_held_moves_the_arm_until_it_is_let_go(live: Live, window: Window) -> None:
    before = height(live)
    window.mouse.move(*up(live, window))
    window.mouse.down()
    until(window, lambda: height(live) > before + 0.05, "the tool has risen")
    window.mouse.up()
    stays(live, window)


def test_a_key_that_is_held_moves_the_arm_until_it_is_let_go(live: Live, window: Window) -> None:
    before = height(live)
    window.keyboard.down("u")
    until(window, lambda: height(live) > before + 0.05, "the tool has risen")
    window.keyboard.up("u")
    stays(live, window)


def test_keys_are_dead_while_another_tab_is_open_or_a_name_is_typed(
    live: Live, window: Window
) -> None:
    window.get_by_role("tab", name="View").click()
    window.keyboard.press("u", delay=200)
    assert live.now.granted is None and live.now.status.mode is Mode.RUNNING
    window.get_by_role("tab", name="Move").click()
    window.get_by_role("textbox", name="Tool [mm]").first.click()
    window.keyboard.press("u", delay=200)
    assert live.now.granted is None


@pytest.mark.slow
def test_a_key_reaches_the_joints_within_60_ms(live: Live, window: Window) -> None:
    """From before the key is pressed to the tick that moves a joint, at 95 of 100 presses."""
    first: list[float] = []

    def note(tick: tuple) -> None:
        x, out = tick
        if out.granted is not None and not first and np.abs(out.command.qd).max() > 0.0:
            first.append(x.now)

    follower = SimpleNamespace(put=note, close=lambda: None)
    live.engine.follow(follower)
    waits = []
    for _ in range(40):
        until(window, lambda: live.now.granted is None, "nobody moves it")
        first.clear()
        pressed = live.engine._clock.now()
        window.keyboard.down("j")
        until(window, lambda: first, "a joint is told to move")
        window.keyboard.up("j")
        waits.append(first[0] - pressed)
    live.engine.unfollow(follower)
    p50, p95 = np.percentile(waits, [50, 95])
    print(f"key to command: {1e3 * p50:.0f} ms, 95 %: {1e3 * p95:.0f} ms")
    assert p95 <= 0.06


def test_a_page_that_is_gone_leaves_the_arm_at_rest(live: Live, window: Window) -> None:
    before = height(live)
    window.keyboard.down("u")
    until(window, lambda: height(live) > before + 0.03, "the tool has risen")
    url = window.url
    window.goto("about:blank")
    until(window, lambda: rests(live), "the arm has come to rest", 3.0)
    assert live.now.status.mode is Mode.HOLDING
    window.goto(url)
    window.wait_for_function(READY, timeout=60_000)
