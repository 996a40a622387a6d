"""Whatever is said, however long: no control moves, and none is lost, on a desk or on a phone."""

import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from conftest import open_window
from hands import resize, until
from playwright.sync_api import Browser
from playwright.sync_api import Page as Window

from app.messages import Command, Mode, Notice, Status
from app.near import Near, Nearness
from app.robot.model import Robot
from app.ui.page import Page
from tests.ui_page import FakeEngine, fake_skin, snapshot

pytestmark = pytest.mark.browser
PERIOD = 0.05  # [s] between two snapshots
LONG = "port /dev/serial/by-id/usb-0001 is lost (unplugged or switched off); " * 6
FIXED = Near(2, 0.087, 0.1, np.zeros(3), np.ones(3), np.array([0.0, 0.0, 1.0]))
LONGEST: dict[str, Any] = {
    "status": Status(Mode.RUNNING, LONG, 0.0),
    "advice": LONG,
    "notice": Notice(LONG, refused=True),
    "program": LONG,
    "inputs": tuple((f"input {k}", LONG) for k in range(4)),
    "command": Command(np.zeros(6), activation=1.0),
    "nearness": Nearness(
        replace(FIXED, link=4, distance=0.123), FIXED, holder=4, held_at=0.123, blocked=1234.0,
        to_go=1.234,
    ),
}  # fmt: skip


class Talker(FakeEngine):
    """Says twenty times a second what it is given."""

    says: dict[str, Any] = {}  # noqa: RUF012 - replaced, never changed


@pytest.fixture(scope="module")
def talker(robot: Robot) -> Iterator[Talker]:
    engine, over = Talker(robot, fake_skin(robot)), threading.Event()

    def speak() -> None:
        while not over.wait(PERIOD):
            now = snapshot(engine, **engine.says)
            engine.snapshots.put(now, now.stamp)

    thread = threading.Thread(target=speak)
    thread.start()
    yield engine
    over.set()
    thread.join()


@pytest.fixture(scope="module")
def window(talker: Talker, browser: Browser) -> Iterator[Window]:
    with Page(talker, port=0) as page:
        page.server.scene.configure_environment_map(None)
        for view in (page.robot, page.stage, page.goal):  # an empty scene is drawn in no time
            for switch in view.switches():
                switch.set(False)
        window = open_window(browser, page.url)
        yield window
        window.close()


@pytest.fixture(autouse=True)
def at_home(talker: Talker) -> None:
    talker.says = {}


PLACES = """() => [...document.querySelectorAll('button, input, [role=tab], [role=slider]')]
    .filter(e => e.checkVisibility() && !e.closest('.mantine-Notifications-root, [role=alert]'))
    .map(e => { const r = e.getBoundingClientRect();
        return [e.textContent.trim() || e.id.slice(-4), Math.round(r.x), Math.round(r.y),
            Math.round(r.width), Math.round(r.height)]; })"""
SIZES = [(1366, 768), (390, 844)]


def said(window: Window, part: str) -> None:
    window.locator(".arm-line", has_text=part).first.wait_for(timeout=20_000)


@pytest.mark.parametrize("size", SIZES)
def test_no_control_moves_when_every_text_is_longest(
    talker: Talker, window: Window, size: tuple[int, int]
) -> None:
    resize(window, size[0], size[1])
    said(window, "just begun")
    window.wait_for_timeout(500)
    for tab in ("Move", "Cell"):
        window.get_by_role("tab", name=tab, exact=True).click()
        talker.says = {}
        said(window, "just begun")
        window.wait_for_timeout(300)
        before = window.evaluate(PLACES)
        assert len(before) > 10
        talker.says = LONGEST
        said(window, "is lost (unplugged")
        window.wait_for_timeout(500)
        assert window.evaluate(PLACES) == before, tab


def test_stop_is_at_the_lower_edge_of_a_phone_in_its_whole_width(window: Window) -> None:
    resize(window, 390, 844)
    stop = window.get_by_role("button", name="Stop", exact=True)

    def wide() -> bool:
        box = stop.bounding_box()
        return box is not None and box["width"] > 370 and box["y"] + box["height"] > 836

    until(window, wide, "Stop is across the lower edge")
    hit = "([x, y]) => document.elementFromPoint(x, y)?.closest('button')?.textContent.trim()"
    assert window.evaluate(hit, [195, 815]) == "Stop"
    middle = "([x, y]) => document.elementFromPoint(x, y)?.tagName"
    assert window.evaluate(middle, [195, 400]) == "CANVAS"  # the scene is in sight
