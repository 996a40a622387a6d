"""The tab of the skin with mouse: from a map to a cone, from a point to its verdict, and off."""

import numpy as np
import pytest
from conftest import Live
from hands import nodes, shown, spot, until
from playwright.sync_api import Page as Window

from app.actions import AddObstacle, SpoilSensor
from app.messages import Verdict
from app.perception.unable import Unable
from app.sensing.spoiled import WELL

pytestmark = pytest.mark.browser
PILLAR = AddObstacle(
    "Pillar", {"kind": "cylinder", "radius_m": 0.2, "length_m": 2.0}, (0.2, -0.9, 0.5)
)


def told(window: Window) -> str:
    """What the page says of the chosen zone."""
    return window.locator("[data-verdict]").inner_text()


def test_a_click_on_a_map_lights_up_its_cone_and_a_zone_tells_its_verdict(
    live: Live, window: Window
) -> None:
    name = live.engine.skin.sensors[17].name
    link = live.engine.skin.sensors[17].link
    window.get_by_role("tab", name="Skin").click()
    map_, sheet = window.get_by_role("button", name=name, exact=True), window.locator(".skin-maps")
    until(window, lambda: sheet.locator("svg").count() == 1, "the maps are drawn")
    # the block is drawn anew several times a second: it may be gone between two looks
    whole = until(window, lambda: sheet.bounding_box(timeout=10_000), "the maps have a place")
    box = map_.bounding_box()
    assert box is not None and whole["x"] - 1 <= box["x"]
    assert box["y"] + box["height"] <= whole["y"] + whole["height"] + 1
    map_.click()
    until(window, lambda: f"/robot/{link}/chosen" in nodes(window), "its cone is in the scene")
    zone = window.get_by_role("button", name="21", exact=True)  # row 3, column 5
    zone.scroll_into_view_if_needed()
    zone.click()
    until(window, lambda: f"{name}, row 3, column 5" in told(window), "the zone is told")


def test_a_click_on_a_point_says_why_it_is_believed(live: Live, window: Window) -> None:
    window.get_by_role("tab", name="Skin").click()
    live.engine.post(PILLAR)
    until(window, lambda: shown(window, "/cloud/kept"), "the skin sees the pillar")

    def hit() -> bool:
        cloud = live.now.cloud
        kept = np.flatnonzero(cloud.verdict == Verdict.KEPT)
        x, y = spot(live.page, cloud.points[kept[len(kept) // 2]])
        window.mouse.click(x, y)
        window.wait_for_timeout(300)
        return live.page.chosen.slot >= 0

    until(window, hit, "a point is picked")
    until(window, lambda: shown(window, "/chosen/point"), "it is marked")
    until(window, lambda: "obstacle" in told(window), "it is called an obstacle")


def test_a_sensor_that_is_switched_off_is_blind_until_it_is_well(
    live: Live, window: Window
) -> None:
    window.get_by_role("tab", name="Skin").click()
    window.get_by_role("button", name=live.engine.skin.sensors[17].name, exact=True).click()
    try:
        off = window.get_by_role("button", name="off", exact=True)
        until(window, off.is_visible, "it can be switched off")
        off.click()
        until(window, lambda: live.now.unable[17] == Unable.SILENT, "it counts as blind")
        until(window, lambda: window.get_by_text("cannot see").count() > 1, "the page says so")
        window.get_by_role("button", name=WELL, exact=True).click()
        until(window, lambda: live.now.unable[17] == Unable.SEES, "it sees again")
    finally:
        live.engine.post(SpoilSensor(17, WELL))
