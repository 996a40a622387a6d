"""Run, Hold, Stop and the state stay where they are; the background is learned by mouse.

The arm here is a puppet that says what a test wants it to say: this is about the page.
"""

import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from conftest import open_window
from hands import resize, until
from playwright.sync_api import Browser
from playwright.sync_api import Page as Window

from app.actions import (
    Action,
    DiscardBackground,
    ForgetBackground,
    KeepBackground,
    LearnBackground,
    SetMode,
)
from app.messages import BackgroundView, Mode, Notice, Status
from app.robot.model import Robot
from app.ui.page import Page
from tests.ui_page import FakeEngine, fake_skin, snapshot

pytestmark = pytest.mark.browser
PERIOD = 0.05  # [s] between two snapshots
HASTE = 4.0  # the puppet's background is learned so many times faster
CELLS = np.zeros((518, 3))
NOTHING = BackgroundView(CELLS[:0], CELLS[:0])
LONG = "port /dev/serial/by-id/usb-0001 is lost (unplugged or switched off); " * 5
SIZES = ((1280, 720), (1000, 600))


@dataclass
class Puppet(FakeEngine):
    """Speaks twenty times a second what `says` holds, and learns a background of 518 cells."""

    says: dict[str, Any] = field(default_factory=dict)
    mute: bool = False
    background: BackgroundView = NOTHING
    ready: float = 0.0  # [s] when the learning ends

    def post(self, action: Action) -> None:
        super().post(action)
        match action:
            case LearnBackground(seconds=seconds):
                self.ready = time.monotonic() + seconds / HASTE
                self.background = replace(self.background, left=seconds)
            case KeepBackground():
                self.background = BackgroundView(self.background.preview, NOTHING.preview)
            case DiscardBackground():
                self.background = replace(self.background, preview=NOTHING.preview, left=0.0)
            case ForgetBackground():
                self.background = NOTHING

    def speak(self) -> None:
        if self.background.left > 0.0:
            left = max(HASTE * (self.ready - time.monotonic()), 0.0)
            preview = CELLS if left == 0.0 else NOTHING.preview
            self.background = replace(self.background, left=left, preview=preview)
        if not self.mute:
            now = snapshot(self, background=self.background, **self.says)
            self.snapshots.put(now, now.stamp)


@pytest.fixture(scope="module")
def puppet(robot: Robot) -> Iterator[Puppet]:
    engine, over = Puppet(robot, fake_skin(robot)), threading.Event()

    def speak() -> None:
        while not over.wait(PERIOD):
            engine.speak()

    thread = threading.Thread(target=speak)
    thread.start()
    yield engine
    over.set()
    thread.join()


@pytest.fixture(scope="module")
def window(puppet: Puppet, browser: Browser) -> Iterator[Window]:
    with Page(puppet, port=0) as page:
        page.server.scene.configure_environment_map(None)
        for view in (page.robot, page.stage, page.goal):  # an empty scene is drawn in no time
            for switch in view.switches():
                switch.set(False)
        window = open_window(browser, page.url, *SIZES[0])
        yield window
        window.close()


@pytest.fixture(autouse=True)
def at_home(puppet: Puppet, window: Window) -> None:
    """Nothing said or learned, and the first tab open."""
    puppet.says, puppet.mute, puppet.background = {}, False, NOTHING
    puppet.posted.clear()
    resize(window, SIZES[0][0], SIZES[0][1])
    window.get_by_role("tab").first.click()
    window.locator('[data-arm="Holding"]').wait_for(timeout=10_000)


def boxes(window: Window) -> list[tuple[float, float, float, float]]:
    """Where Run, Hold, Stop and the state are: x, y, width, height [px]."""
    out = [window.get_by_role("button", name=n, exact=True) for n in ("Run", "Hold", "Stop")]
    found = [place.bounding_box() for place in (*out, window.locator("[data-arm]"))]
    return [(b["x"], b["y"], b["width"], b["height"]) for b in found if b is not None]


def in_sight(window: Window) -> bool:
    """Are all four whole inside the window, with nothing above them?"""
    width, height = window.viewport_size["width"], window.viewport_size["height"]  # type: ignore[index]
    spots = boxes(window)
    inside = all(x >= 0 and y >= 0 and x + w <= width and y + h <= height for x, y, w, h in spots)
    hit = """([x, y]) => document.elementFromPoint(x, y)?.closest('button, [data-arm]') !== null"""
    open_to_hands = all(window.evaluate(hit, [x + w / 2, y + h / 2]) for x, y, w, h in spots)
    return len(spots) == 4 and inside and open_to_hands


PICTURES = """async n => {
    for (; n > 0; n--) await new Promise(drawn => requestAnimationFrame(drawn))
}"""


def settled(window: Window) -> bool:
    """Is the page laid out, and stays so over ten pictures?"""
    before = boxes(window)
    window.evaluate(PICTURES, 10)  # the panel follows a new size a picture or two later
    return in_sight(window) and boxes(window) == before


def test_run_hold_and_stop_never_move(puppet: Puppet, window: Window) -> None:
    for width, height in SIZES:
        resize(window, width, height)
        until(window, lambda: settled(window), f"all in sight at {width}x{height}")
        before = boxes(window)

        def stay(why: str, before: list[Any] = before) -> None:
            assert boxes(window)[:3] == before[:3], why
            assert in_sight(window), why

        puppet.says = {"status": Status(Mode.HOLDING, LONG, 0.0), "advice": LONG}
        window.get_by_text("is lost (unplugged").first.wait_for()
        stay("a long reason")
        puppet.says = {"notice": Notice(LONG, refused=True)}
        window.get_by_text("Refused: port").wait_for()
        stay("a notice")
        puppet.says = {}
        window.get_by_text("Refused: port").wait_for(state="hidden")
        stay("no notice")
        for tab in ("Settings", "Help"):
            window.get_by_role("tab", name=tab).click()
            stay(f"the tab {tab}")
            window.get_by_role("tab", name=tab).hover()
            window.mouse.move(width - 60, height - 60)
            window.mouse.wheel(0, 5000)
            window.wait_for_timeout(200)
            stay(f"the tab {tab} scrolled to its end")


def test_no_slip_of_the_mouse_puts_them_away(window: Window) -> None:
    """viser's own column folds up at a click on its upper edge, and is dragged away by it."""
    before = boxes(window)
    x, y, width, height = before[1]
    for edge in (3.0, y + height + 5.0):
        window.mouse.click(x + width / 2.0, edge)
        window.mouse.down()
        window.mouse.move(x - 300.0, edge + 200.0, steps=4)
        window.mouse.up()
        window.wait_for_timeout(250)  # viser folds a column up in 160 ms
        assert boxes(window) == before and in_sight(window)


def test_an_engine_that_says_no_more_moves_nothing(puppet: Puppet, window: Window) -> None:
    before = boxes(window)
    puppet.mute = True
    window.get_by_text("the engine has not spoken for").wait_for(timeout=5_000)
    assert boxes(window)[:3] == before[:3]


def test_a_long_text_is_whole_where_the_mouse_rests(puppet: Puppet, window: Window) -> None:
    puppet.says = {"notice": Notice(LONG, refused=True)}
    window.get_by_title("Refused: port").wait_for()
    assert window.get_by_title("Refused: port").get_attribute("title") == f"Refused: {LONG}"
    assert window.get_by_text("Forearm, 25 cm (keeps 25): can give way").is_visible()


def test_stop_can_be_pressed_by_mouse_and_key(puppet: Puppet, window: Window) -> None:
    window.get_by_role("button", name="Stop", exact=True).click()
    until(window, lambda: len(puppet.posted) == 1, "pressed")
    window.keyboard.press("s")
    until(window, lambda: len(puppet.posted) == 2, "the key")
    assert [a.mode for a in puppet.posted if isinstance(a, SetMode)] == 2 * [Mode.STOPPED]


def test_the_background_is_learned_kept_and_forgotten_by_mouse(
    puppet: Puppet, window: Window
) -> None:
    def press(name: str) -> None:
        window.get_by_role("button", name=name, exact=True).click()

    window.get_by_role("tab", name="Cell").click()
    assert window.get_by_role("button", name="Forget background").is_disabled()
    press("Learn background")
    window.get_by_text("People must be out of the cell").wait_for()
    assert puppet.posted == []
    press("Begin")
    window.get_by_text("s to go").wait_for()
    window.get_by_text("518 cells found").wait_for()
    press("Keep")
    window.get_by_text("518 cells are known").wait_for()
    press("Forget background")
    window.get_by_text("Forget all 518 known cells?").wait_for()
    press("Forget all of it")
    window.get_by_text("Nothing is learned").wait_for()
    kinds = [LearnBackground, KeepBackground, ForgetBackground]
    assert [type(action) for action in puppet.posted] == kinds
