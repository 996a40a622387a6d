"""A run is recorded, and a stop kept, by mouse and keyboard."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import Live, open_window
from hands import until
from playwright.sync_api import Browser
from playwright.sync_api import Page as Window

from app.actions import SetMode
from app.config import Params
from app.messages import Goal, Mode
from app.record.reader import open_recording
from app.record.ring import Ring
from app.setup import Setup
from app.timing import WallClock
from app.ui.desk import Desk
from app.ui.inside import uuid_of
from app.ui.page import Page
from app.wiring import build_engine

pytestmark = pytest.mark.browser
SETUP = Setup(scene="empty", rate=50.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("run") / "recordings"


@pytest.fixture(scope="module")
def live(folder: Path) -> Iterator[Live]:
    """An arm in an empty place, with its ring and its desk."""
    # a browser that starts may hold the processor for a second
    engine = build_engine(SETUP, WallClock(), Params(silence=2.0))
    ring = Ring(engine, SETUP)
    engine.follow(ring)
    engine.start()
    try:
        desk = Desk(engine, SETUP, folder, ring)
        with Page(engine, port=0, desk=desk) as page:
            page.stage.cast_shadows(False)
            page.server.scene.configure_environment_map(None)
            for view in (page.robot, page.stage, page.goal):  # an empty scene is drawn in no time
                for switch in view.switches():
                    switch.set(False)
            yield Live(engine, page, Goal(engine.robot.posture(engine.robot.home).T_base_tool))
    finally:
        engine.close()


@pytest.fixture(scope="module")
def window(live: Live, browser: Browser) -> Iterator[Window]:
    window = open_window(browser, live.page.url)
    window.set_default_timeout(60_000)
    window.get_by_role("tab", name="Record").click()
    yield window
    window.close()


@pytest.fixture(autouse=True)
def at_home(live: Live, window: Window) -> None:
    """It runs, and nothing is recorded."""
    live.engine.post(SetMode(Mode.RUNNING))
    until(window, lambda: live.now.status.mode is Mode.RUNNING, "it runs")


def files(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.mcap")) if folder.exists() else []


def test_a_recording_begins_and_ends_by_mouse(live: Live, window: Window, folder: Path) -> None:
    window.get_by_text("Nothing is recorded.").wait_for()
    window.get_by_role("button", name="Record", exact=True).click()
    window.get_by_text("nothing dropped").wait_for()
    begun = live.now.tick
    until(window, lambda: live.now.tick > begun + 50, "a second passes")
    window.get_by_role("button", name="End the recording").click()
    window.get_by_text("flinch replay").wait_for()
    (path,) = files(folder)
    assert window.get_by_text(path.name).first.is_visible()
    with open_recording(path) as recording:
        assert recording.torn == "" and len(recording) >= 40
    path.unlink()


def test_a_stop_is_kept_by_keyboard_under_its_reason(
    live: Live, window: Window, folder: Path
) -> None:
    live.engine.post(SetMode(Mode.STOPPED, reason="a test pulled the plug"))
    window.get_by_text("save it now").wait_for()
    window.get_by_role("button", name="Save the last 30 s").focus()
    window.keyboard.press("Enter")
    until(window, lambda: files(folder), "it is saved", 60.0)
    (path,) = files(folder)
    assert path.name.endswith("_stopped-a-test-pulled-the-plug.mcap")
    window.get_by_text("flinch export").wait_for()
    with open_recording(path) as recording:
        assert any(mark.kind == "stop" for mark in recording.marks)


def test_who_only_watches_can_neither_record_nor_save(live: Live, window: Window) -> None:
    panel = live.page.record
    assert panel is not None
    for control in (panel.begin, panel.end, panel.save):
        assert uuid_of(control) not in live.page.gate.free
