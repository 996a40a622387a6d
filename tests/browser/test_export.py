"""An exported page as who was mailed it uses it: opened from disk, with a mouse and a keyboard."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import viser
from hands import until
from playwright.sync_api import Browser
from playwright.sync_api import Page as Window

from app.cell.parts import Cell
from app.messages import Snapshot
from app.robot.model import Robot
from app.ui.export.export import exported
from app.ui.export.gallery import write_index
from app.ui.export.pages import page_of
from tests.export_clip import arm_of, run

pytestmark = pytest.mark.browser
LINK = "/robot/wrist_3_link"


class Bare:
    """Instead of light, sky and ground, which take most of the time without a graphics card."""

    def __init__(self, server: viser.ViserServer, cell: Cell) -> None:
        server.scene.configure_environment_map(None)
        server.scene.configure_default_lights(cast_shadow=False)

    def update(self, snapshot: Snapshot) -> None:
        pass


@pytest.fixture(scope="module")
def folder(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run, and an index of it."""
    folder, arm = tmp_path_factory.mktemp("clips"), arm_of(robot)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("app.ui.export.film.Stage", Bare)
        clip = exported(arm, run(arm), name="A run")
    (folder / "a run.html").write_text(page_of(arm, [clip], "Recorded in a test."), "utf-8")
    write_index(folder)
    return folder


@pytest.fixture(scope="module")
def asked() -> list[str]:
    """Every address that the window has asked for."""
    return []


@pytest.fixture(scope="module")
def window(folder: Path, browser: Browser, asked: list[str]) -> Iterator[Window]:
    """At rest half a second after the beginning, come to by the link of the index."""
    window = browser.new_page(viewport={"width": 820, "height": 560})
    window.set_default_timeout(90_000)
    window.on("request", lambda request: asked.append(request.url))
    window.goto((folder / "index.html").as_uri())
    window.get_by_role("link").click()
    window.wait_for_selector("body[data-ready]", timeout=60_000)
    yield window
    window.close()


@pytest.fixture(autouse=True)
def at_rest(window: Window) -> None:
    window.evaluate("seek(0.5)")


def place(window: Window) -> list[float]:
    """Where the scene draws the last link."""
    script = "l => players[0].window.__viserMutable.nodePoseData[l]?.position ?? []"
    found: Any = window.evaluate(script, LINK)
    return list(found)


def clock(window: Window) -> float:
    text = window.get_by_label("Time", exact=True).text_content()
    assert text is not None
    return float(text.split()[0])


def test_it_plays_by_itself_from_disk_and_asks_nobody(window: Window, asked: list[str]) -> None:
    window.evaluate("seek(0)")
    before = place(window)
    window.get_by_role("button", name="Play or pause").click()
    until(window, lambda: clock(window) > 0.1, "time goes on")
    until(window, lambda: place(window) not in ([], before), "the scene moves", 60.0)
    assert [url for url in asked if not url.startswith(("file:", "blob:", "data:"))] == []
    assert window.evaluate("location.protocol") == "file:"


def test_scene_caption_and_chart_show_one_moment(window: Window) -> None:
    there = place(window)
    box = window.get_by_role("slider", name="Time in seconds").bounding_box()
    assert box is not None
    window.mouse.click(box["x"] + 46 + 0.9 * (box["width"] - 58), box["y"] + 60)
    assert clock(window) == pytest.approx(0.9, abs=0.05)
    until(window, lambda: place(window) != there, "the scene follows", 60.0)
    assert window.get_by_text("Stopped", exact=True).is_visible()


@pytest.mark.slow
def test_dragging_along_the_chart_goes_back_and_forth(window: Window) -> None:
    box = window.get_by_role("slider", name="Time in seconds").bounding_box()
    assert box is not None
    y = box["y"] + 60
    window.mouse.move(box["x"] + 0.8 * box["width"], y)
    window.mouse.down()
    late = clock(window)
    window.mouse.move(box["x"] + 0.2 * box["width"], y, steps=5)
    window.mouse.up()
    assert clock(window) < 0.3 < 0.7 < late


@pytest.mark.slow
def test_the_keys_play_step_and_jump(window: Window) -> None:
    window.mouse.click(5, 5)
    window.keyboard.press("Home")
    assert clock(window) == 0.0
    window.keyboard.press("ArrowRight")
    assert 0.0 < clock(window) < 0.1
    window.keyboard.press("ArrowLeft")
    assert clock(window) == 0.0
    window.keyboard.press("End")
    assert clock(window) > 0.9
    window.keyboard.press(" ")
    until(window, lambda: window.get_by_text("Pause").is_visible(), "it plays")
    window.keyboard.press(" ")
    until(window, lambda: window.get_by_text("Play", exact=False).first.is_visible(), "it rests")


@pytest.mark.slow
def test_the_legend_hides_and_shows(window: Window) -> None:
    entry = window.get_by_role("button", name="Kept points")
    look = """() => { const node = players[0].tree.useSceneTree.getAll()["/cloud/kept"];
        return node.overrideVisibility ?? node.visibility; }"""
    until(window, lambda: window.evaluate(look) is True, "points are shown", 60.0)
    entry.click()
    assert entry.get_attribute("aria-pressed") == "false"
    assert window.evaluate(look) is False
    entry.click()
    until(window, lambda: window.evaluate(look) is True, "and again", 60.0)


@pytest.mark.slow
def test_a_mark_tells_why_where_the_mouse_rests(window: Window) -> None:
    box = window.get_by_role("slider", name="Time in seconds").bounding_box()
    assert box is not None
    window.mouse.move(box["x"] + window.evaluate("x(0.8)"), box["y"] + 60)
    hint = window.get_by_text("Stopped: lost <b>port</b>").first
    hint.wait_for(timeout=5_000)


@pytest.mark.slow
def test_a_link_to_a_moment_opens_at_it(folder: Path, browser: Browser) -> None:
    window = browser.new_page(viewport={"width": 500, "height": 400})
    window.goto((folder / "a run.html").as_uri() + "#t=0.7")
    assert clock(window) == pytest.approx(0.7)
    assert "Play" in (window.get_by_role("button", name="Play or pause").text_content() or "")
    window.close()
