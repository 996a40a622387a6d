"""Three types of sensors in one skin, seen on the page: two of them are TOML files of the test."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from conftest import Live, running
from hands import nodes, props, shown, until
from playwright.sync_api import Page as Window

from app.actions import AddObstacle
from app.messages import Verdict
from app.robot.model import find_robot, load_robot
from app.robot.skin_file import load_skin
from tests import mixed_skin

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Live]:
    """With a skin of an 8x8, a 16x16 and a single-zone sensor."""
    robot = load_robot(find_robot("ur10e"))
    layout: Path = mixed_skin.write(tmp_path_factory.mktemp("skin"))
    with running(robot, load_skin(layout, robot)) as arm:
        yield arm


def wall(live: Live) -> AddObstacle:
    """A ball before all three of them, far enough not to be felt."""
    T = live.now.T_base_link[live.engine.robot.links.index("forearm_link")]
    centre = T[:3, :3] @ np.add(mixed_skin.LENS, [0.0, 1.2, 0.0]) + T[:3, 3]
    x, y, z = centre.tolist()
    return AddObstacle("Ball", {"kind": "sphere", "radius_m": 0.4}, (x, y, z))


def test_every_type_has_its_own_field_of_view_and_its_points(live: Live, window: Window) -> None:
    views = {f"/robot/forearm_link/sensors{tail}" for tail in ("", "-2", "-3")}
    until(window, lambda: views <= nodes(window), f"fields of view: {views - nodes(window)}")
    live.engine.post(wall(live))
    skin = live.engine.skin

    def seen() -> bool:
        kept = live.now.cloud.verdict == Verdict.KEPT
        return set(skin.sensor_of[kept].tolist()) == {0, 1, 2}

    until(window, seen, "all three sensors see the ball")
    until(window, lambda: shown(window, "/cloud/kept"), "the points are drawn")
    # three numbers a slot, whatever the sensor
    assert len(props(window, "/cloud/kept")["points"]) == 3 * skin.slots


def test_the_zones_of_any_grid_are_drawn(live: Live, window: Window) -> None:
    window.get_by_role("tab", name="Skin").click()
    for name, grid, cells in (("eight", "8x8", 64), ("wide", "16x16", 256), ("point", "1x1", 1)):
        window.get_by_role("button", name=name, exact=True).click()
        picture = window.locator(f'[data-zones="{grid}"]')
        picture.wait_for(timeout=20_000)
        assert picture.locator("rect").count() == cells
