"""The page's switch between real and simulated sensors, and what it tells of the ports."""

import asyncio
from types import SimpleNamespace

import numpy as np
import pytest

from app.actions import UseSensor
from app.messages import SensorHealth, Verdict
from app.robot.skin_file import load_skin
from app.ui.colours import POINT, css
from app.ui.panels.health_panel import HealthPanel, latency
from app.ui.panels.sensors_panel import SensorsPanel, zone_picture
from tests import mixed_skin
from tests.ui_page import serving


@pytest.fixture
def page(skin):
    posted = []
    engine = SimpleNamespace(skin=skin, source="serial /dev/a", post=posted.append)
    with serving(port=0) as server:
        yield server, engine, posted


def told(stamp, real):
    health = np.full(30, SensorHealth.GOOD, dtype=np.uint8)
    health[1] = SensorHealth.STALE
    return SimpleNamespace(stamp=stamp, health=health, real=real)


def test_the_switch_shows_only_for_a_mixed_skin_and_tells_the_chosen_sensor(page):
    server, engine, _ = page
    panel = SensorsPanel(server, engine)
    panel.update(told(1.0, None))
    assert not panel.folder.visible
    real = np.arange(30) < 10
    panel.update(told(2.0, real))
    assert panel.folder.visible and panel.state.value == "real, good (10 of 30 real)"
    panel.choice._impl.value = "ring1-02"
    panel.update(told(3.0, real))
    assert panel.state.value == "real, stale (10 of 30 real)"
    panel.choice._impl.value = "ring3-10"
    panel.update(told(4.0, real))
    assert panel.state.value == "simulated, good (10 of 30 real)"


@pytest.mark.parametrize("word", ["real", "simulated"])
def test_the_buttons_switch_the_chosen_sensor(page, word):
    server, engine, posted = page
    panel = SensorsPanel(server, engine)
    panel.choice._impl.value = "ring2-03"
    panel.switch._impl.value = word
    event = SimpleNamespace(client_id=0, client=None, target=panel.switch)
    for callback in panel.switch._impl.update_cb:
        asyncio.run_coroutine_threadsafe(callback(event), server.get_event_loop()).result(5.0)
    assert posted == [UseSensor("ring2-03", word == "real")]


def test_the_picture_of_a_sensors_zones_has_its_rows_and_columns_and_the_points_colours(
    robot, tmp_path
):
    skin = load_skin(mixed_skin.write(tmp_path), robot)
    verdict = np.full(skin.slots, Verdict.NO_TARGET, dtype=np.uint8)
    verdict[skin.first[1] + 17] = Verdict.KEPT
    snapshot = SimpleNamespace(cloud=SimpleNamespace(verdict=verdict))
    for k, (grid, cells) in enumerate((("8x8", 64), ("16x16", 256), ("1x1", 1))):
        picture = zone_picture(snapshot, skin, k)
        assert f'data-zones="{grid}"' in picture and picture.count("<i ") == cells
        assert picture.count(css(POINT[Verdict.KEPT])) == (k == 1)
    cell = zone_picture(snapshot, skin, 1).split("<i ")[18]
    assert css(POINT[Verdict.KEPT]) in cell and 'title="kept"' in cell


def test_the_zones_are_sent_only_while_a_person_looks_at_them(page):
    server, engine, _ = page
    panel, seen = SensorsPanel(server, engine), told(1.0, None)
    seen.cloud = SimpleNamespace(verdict=np.zeros(engine.skin.slots, dtype=np.uint8))
    panel.update(seen)
    assert panel.kind.value.startswith("ST VL53L8CX") and panel.zones.content == ""
    panel.look._impl.value = True
    seen.stamp = 2.0
    panel.update(seen)
    assert panel.zones.visible and 'data-zones="8x8"' in panel.zones.content


def test_health_tells_the_latency_and_every_port(page):
    server, engine, _ = page
    panel = HealthPanel(server, engine, SimpleNamespace())
    snapshot = SimpleNamespace(
        stamp=10.0, health=np.full(30, SensorHealth.GOOD), rate=np.full(30, 15.0),
        cloud=SimpleNamespace(stamp=np.full(30, 9.98)),
        delay=np.array([np.nan, *[0.02] * 28, 0.08]),
        inputs=(("/dev/a", "good · binary · 10 sensors"), ("/dev/<b>", "lost")),
    )  # fmt: skip
    rows = dict(panel._sensors(snapshot))
    assert rows["measured to used, median / worst"] == "20 / 80 ms"
    assert rows["/dev/a"] == "good · binary · 10 sensors" and rows["/dev/&lt;b&gt;"] == "lost"
    assert latency(SimpleNamespace(delay=np.full(3, np.nan))) == "-"
