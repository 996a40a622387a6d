"""The main act of Plots, Settings and Cell with mouse and keyboard."""

import csv
from pathlib import Path
from typing import Any

import pytest
from conftest import Live
from hands import nodes, until
from playwright.sync_api import Page as Window

from app.actions import SetPerson
from app.config import Params

pytestmark = pytest.mark.browser


def test_the_plots_tell_values_under_the_mouse_and_are_saved(
    live: Live, window: Window, tmp_path: Path
) -> None:
    window.get_by_role("tab", name="Plots").click()
    chart = window.locator(".uplot").first

    def wide() -> Any:
        box = chart.bounding_box(timeout=20_000)
        return box if box is not None and box["width"] > 200 else None

    box = until(window, wide, "the chart is drawn", 40.0)
    value = chart.locator(".u-legend .u-series").nth(3).locator(".u-value")  # what is kept

    def told() -> bool:
        for share in (0.85, 0.9):
            window.mouse.move(box["x"] + share * box["width"], box["y"] + 60)
            window.wait_for_timeout(100)
        return value.inner_text() == "25"

    until(window, told, "the value under the mouse")
    with window.expect_download() as saved:
        window.get_by_role("button", name="Save as CSV").click()
    saved.value.save_as(tmp_path / "plots.csv")
    rows = list(csv.DictReader((tmp_path / "plots.csv").read_text().splitlines()))
    assert len(rows) > 5 and float(rows[-1]["kept_m"]) == 0.25 and rows[-1]["controller"]
    with window.expect_download() as drawn:
        window.get_by_role("button", name="Save a picture (PNG)").click()
    drawn.value.save_as(tmp_path / "plots.png")
    assert (tmp_path / "plots.png").read_bytes().startswith(b"\x89PNG")


def test_a_preset_is_one_press_and_back_is_another(live: Live, window: Window) -> None:
    window.get_by_role("tab", name="Settings").click()
    window.get_by_role("button", name="careful", exact=True).click()
    until(window, lambda: live.now.params.distance_kept == 0.35, "the arm keeps more distance")
    until(window, lambda: window.get_by_text("changed, as careful").is_visible(), "it is told")
    window.get_by_role("button", name="Distance kept", exact=True).click()
    kept = Params().distance_kept
    until(window, lambda: live.now.params.distance_kept == kept, "back at the default")


def test_a_person_comes_and_goes_and_a_body_is_taken_back(live: Live, window: Window) -> None:
    window.get_by_role("tab", name="Cell").click()
    try:
        window.get_by_role("button", name="works", exact=True).click()
        until(window, lambda: "/world/person/head" in nodes(window), "a person")
        window.get_by_role("button", name="none", exact=True).click()
        until(window, lambda: "/world/person/head" not in nodes(window), "nobody")
    finally:
        live.engine.post(SetPerson("none"))
    window.get_by_role("button", name="Box", exact=True).click()
    until(window, lambda: "/world/Box 1" in nodes(window), "the box is in the scene")
    window.keyboard.press("Control+z")
    until(window, lambda: "/world/Box 1" not in nodes(window), "the box is taken back")
    window.keyboard.press("Control+Shift+z")
    until(window, lambda: "/world/Box 1" in nodes(window), "and put there again")
