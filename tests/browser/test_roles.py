"""Two people at two pages: one operates, the other watches, stops, and takes over."""

import numpy as np
import pytest
from conftest import Live, open_window
from hands import drag, spot, until
from playwright.sync_api import Browser
from playwright.sync_api import Page as Window

from app.messages import Mode

pytestmark = pytest.mark.browser


def says(window: Window, words: str) -> bool:
    return window.get_by_text(words).first.is_visible()


def test_the_second_page_watches_stops_and_takes_over(
    live: Live, window: Window, browser: Browser
) -> None:
    other = open_window(browser, live.page.url, 900, 600)
    try:
        assert says(window, "You operate the arm (page 1)")
        assert says(other, "You watch (page 2); page 1 operates")
        run, stop = (other.get_by_role("button", name=name, exact=True) for name in ("Run", "Stop"))
        until(other, run.is_disabled, "the watcher's Run is disabled")
        assert window.get_by_role("button", name="Run", exact=True).is_enabled()

        stop.click()
        until(other, lambda: live.now.status.mode is Mode.STOPPED, "a watcher can stop the arm")
        other.keyboard.press("r")
        until(other, lambda: says(other, "You watch"), "a hint")
        other.get_by_text("page 1 operates; you can stop the arm").wait_for(timeout=5_000)
        assert live.now.status.mode is Mode.STOPPED

        other.get_by_role("button", name="Take control").click()
        until(other, lambda: says(other, "page 1 operates; it is free when"), "told when")
        window.get_by_role("button", name="Give control back").click()
        until(other, lambda: says(other, "nobody operates"), "the lease is free")
        other.get_by_role("button", name="Take control").click()
        until(other, run.is_enabled, "the second page operates")
        run.click()
        until(other, lambda: live.now.status.mode is Mode.RUNNING, "it runs the arm")
        assert says(window, "You watch (page 1); page 2 operates")

        # a watcher's drag is refused, and its handle returns to the goal
        before, home = live.now.goal.T_base_tool, live.goal.T_base_tool
        origin, axis = home[:3, 3], home[:3, 2]
        refused = live.page.gate.refused
        drag(window, spot(live.page, origin + 0.24 * axis), spot(live.page, origin))
        until(window, lambda: live.page.gate.refused > refused + 1, "the drag is refused")
        np.testing.assert_array_equal(live.now.goal.T_base_tool, before)
    finally:
        other.close()
    until(window, lambda: says(window, "nobody operates"), "a closed page gives it back")
    window.get_by_role("button", name="Take control").click()
    until(window, lambda: says(window, "You operate the arm (page 1)"), "the first again")
