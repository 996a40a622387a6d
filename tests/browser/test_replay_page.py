"""A recording on its page, by mouse and by keyboard: play, pause, step, scrub, marks."""

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pytest
from conftest import open_window
from hands import pictures, position, until
from playwright.sync_api import Browser
from playwright.sync_api import Page as Window

from app.replay.made import player_of
from app.replay.player import Player
from app.timing import WallClock
from app.ui.replay_page import ReplayPage
from tests.recorded_run import kept_run

pytestmark = pytest.mark.browser
TOOL = "/robot/wrist_3_link"


class Shown(NamedTuple):
    """A recording of three seconds with a stop in it, and its page."""

    player: Player
    page: ReplayPage


@pytest.fixture(scope="module")
def shown() -> Iterator[Shown]:
    player, survey = player_of(kept_run(3.0), WallClock(), {"mode": "wb"}, "recorded, run.mcap")
    with ReplayPage(player, survey, port=0) as page:
        page.server.scene.configure_environment_map(None)
        for view in (page.robot, page.stage, page.world):  # an empty scene is drawn in no time
            for switch in view.switches():
                switch.set(False)
        player.start()
        yield Shown(player, page)
        player.stop()


@pytest.fixture(scope="module")
def window(shown: Shown, browser: Browser) -> Iterator[Window]:
    window = open_window(browser, shown.page.url)
    yield window
    window.close()


@pytest.fixture(autouse=True)
def at_home(shown: Shown, window: Window) -> None:
    """Paused at the first tick, at its own speed."""
    shown.player.pause()
    shown.player.set_speed(1.0)
    shown.player.seek(0)
    window.get_by_text("tick 0").wait_for(timeout=10_000)


def press(window: Window, name: str) -> None:
    window.get_by_role("button", name=name, exact=True).click()


def tick(window: Window) -> int:
    """The tick that the page says it shows."""
    words = window.get_by_text(re.compile(r"of \d+\.\d+ s · tick \d+")).first.inner_text()
    found = re.search(r"tick (\d+)", words)
    assert found is not None
    return int(found.group(1))


def test_it_plays_and_pauses_by_mouse_and_the_arm_moves(shown: Shown, window: Window) -> None:
    before = position(window, TOOL)
    press(window, "Play")
    until(window, lambda: tick(window) > 40, "it plays")
    press(window, "Pause")
    until(window, lambda: not shown.player.playing, "it is paused")
    here = until(window, lambda: tick(window) == shown.player.at and tick(window), "it stands")
    window.wait_for_timeout(400)
    assert tick(window) == here
    T_base_link = shown.player.timeline.snapshot(here).T_base_link
    place = T_base_link[shown.player.robot.link_index("wrist_3_link"), :3, 3]
    until(window, lambda: np.abs(position(window, TOOL) - place).max() < 1e-3, "the arm is there")
    assert np.abs(place - before).max() > 1e-3


@pytest.mark.slow
def test_the_key_plays_and_pauses(shown: Shown, window: Window) -> None:
    window.keyboard.press("p")
    until(window, lambda: tick(window) > 10, "it plays")
    window.keyboard.press("p")
    until(window, lambda: not shown.player.playing, "it is paused")


def test_a_step_is_one_tick_by_mouse_and_by_key(shown: Shown, window: Window) -> None:
    press(window, "Next")
    until(window, lambda: tick(window) == 1, "a tick on")
    window.keyboard.press("n")
    until(window, lambda: tick(window) == 2, "another one")
    press(window, "Back")
    window.keyboard.press("b")
    until(window, lambda: tick(window) == 0, "and back")
    assert not shown.player.playing


@pytest.mark.slow
def test_the_bar_is_dragged_to_any_moment(shown: Shown, window: Window) -> None:
    thumb = window.get_by_role("slider").first
    box, track = thumb.bounding_box(), window.locator(".mantine-Slider-track").first.bounding_box()
    assert box is not None and track is not None
    x, y = box["x"] + box["width"] / 2.0, box["y"] + box["height"] / 2.0
    window.mouse.move(x, y)
    window.mouse.down()
    for share in (0.3, 0.9, 0.5):
        window.mouse.move(track["x"] + share * track["width"], y, steps=4)
        pictures(window, 2)
    window.mouse.up()
    half = shown.player.last / 2.0
    until(window, lambda: abs(tick(window) - half) < 0.05 * half, "half-way")
    seen = tick(window)
    assert shown.player.at == seen
    window.mouse.move(10.0, 10.0)
    window.wait_for_timeout(500)
    assert tick(window) == seen  # nothing pulls it away


def test_the_keys_go_from_mark_to_mark_and_the_page_tells_the_stop(
    shown: Shown, window: Window
) -> None:
    stop = next(m for m in shown.player.timeline.recording.marks if m.kind == "stop")
    for _ in range(8):
        before = tick(window)
        if before >= stop.tick:
            break
        window.keyboard.press("k")
        until(window, lambda before=before: tick(window) > before, "the next mark")
    assert tick(window) == stop.tick
    window.locator('[data-arm="Stopped"]').wait_for(timeout=5_000)
    window.keyboard.press("j")
    until(window, lambda: tick(window) < stop.tick, "the mark before")
    window.locator('[data-arm="Stopped"]').wait_for(state="detached", timeout=5_000)


@pytest.mark.slow
def test_the_speed_is_chosen_from_the_list(shown: Shown, window: Window) -> None:
    window.get_by_label("Speed").click()
    window.get_by_role("option", name="4 x").click()
    until(window, lambda: shown.player.speed == 4.0, "four times")


def test_nothing_on_it_could_act_and_it_says_that_it_is_recorded(window: Window) -> None:
    for name in ("Run", "Hold", "Stop", "Go there", "Start", "Learn background", "Delete it"):
        assert window.get_by_role("button", name=name, exact=True).count() == 0
    assert window.get_by_label("Controller").count() == 0
    assert window.get_by_text("Recorded: nothing here moves an arm").is_visible()
    window.get_by_role("tab", name="Settings").click()
    window.get_by_text("Distance kept").wait_for()
    assert window.get_by_role("slider").count() == 1  # the bar alone
    window.get_by_role("tab", name="Recording").last.click()


@pytest.mark.slow
def test_a_ghost_stands_beside_the_arm_in_the_scene(shown: Shown, window: Window) -> None:
    window.get_by_text("Closest if the command went on for 0.5 s").wait_for()
    shown.player.seek(200)
    until(window, lambda: tick(window) == 200, "there")
    ghost = shown.player.timeline.moment(200).ghost
    assert ghost is not None and ghost.mode == "wb"
    i = shown.player.robot.link_index("wrist_3_link")
    place = ghost.T_base_link[i, :3, 3]
    name = "/ghost/wrist_3_link"
    until(window, lambda: np.abs(position(window, name) - place).max() < 1e-3, "the ghost")
