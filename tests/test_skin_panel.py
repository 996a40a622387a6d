"""The tab of the skin: maps of all sensors, one in full, what is done to them, and the ports."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.actions import SpoilSensor, UseSensor
from app.messages import SensorHealth, Verdict
from app.perception.unable import Unable
from app.robot.skin_file import load_skin
from app.sensing.spoiled import OFF
from app.ui.chosen import NOBODY
from app.ui.colours import ALARM, GHOST, POINT, css
from app.ui.panels.health_panel import HealthPanel, latency
from app.ui.panels.skin_panel import NO_SENSOR, dots, worst_first
from app.ui.zone_maps import COLOURS, HATCHED, NOTHING, STEPS, Sheet, levels, one, scale
from tests import mixed_skin
from tests.ui_page import (  # noqa: F401 - fixtures
    SENSORS,
    run,
    serving,
    show,
    snapshot,
    the_built,
    the_clock,
    the_engine,
    the_page,
)


@pytest.fixture
def seen(page, engine):
    """A snapshot that the page shows, with nothing chosen before."""
    page.chosen.take_sensor(NOBODY)

    def shown(**changes):
        value = snapshot(engine, **changes)
        show(page, engine, value)
        return value

    return shown


def test_near_is_bright_far_is_dark_and_no_use_is_neither():
    distance = np.array([0.0, 0.25, 4.0, 9.0, np.nan, 0.3])
    verdict = np.full(6, Verdict.KEPT, dtype=np.uint8)
    verdict[5] = Verdict.BAD_STATUS
    assert levels(distance, verdict).tolist() == [STEPS - 1, 24, 0, 0, NOTHING, HATCHED]
    light = [sum(int(c[i : i + 2], 16) for i in (1, 3, 5)) for c in COLOURS]
    assert (np.diff(light) > -25).all() and light[-1] > 3 * light[0]


def test_the_sheet_has_every_zone_of_every_grid_and_few_letters(robot, tmp_path, skin):
    rng = np.random.default_rng(3)
    for layout in (skin, load_skin(mixed_skin.write(tmp_path), robot)):
        sheet = Sheet(layout)
        far = rng.uniform(0.02, 4.0, layout.slots)
        verdict = np.full(layout.slots, Verdict.KEPT, dtype=np.uint8)
        svg = sheet.svg(far, verdict, [""] * layout.count, 0)
        long = [float(w) for w in re.findall(r"h([\d.]+)", svg.split("<path stroke")[1])]
        assert long and "NaN" not in svg and svg.count("<rect") == 1  # the frame of the chosen
        area = 0.0
        for high, d in re.findall(r'stroke-width="([\d.]+)" d="([^"]*)"', svg):
            area += float(high) * sum(map(float, re.findall(r"h([\d.]+)", d)))
        assert area == pytest.approx(layout.count * 50 * 50, rel=1e-3)
    worst = Sheet(skin).svg(far_of(skin), np.full(skin.slots, Verdict.SELF, np.uint8), [""] * 30, 0)
    assert len(worst) < 90_000  # all zones thrown away: the most there is to draw


def far_of(skin):
    return np.random.default_rng(1).uniform(0.02, 4.0, skin.slots)


@pytest.mark.parametrize("grid", [(8, 8), (4, 4), (16, 16), (1, 1)])
def test_a_single_sensor_shows_its_distances_its_hatches_and_its_corners(grid):
    n = grid[0] * grid[1]
    far, verdict = np.full(n, 0.42), np.full(n, Verdict.KEPT, dtype=np.uint8)
    svg = one(far, verdict, grid)
    assert f'data-zones="{grid[0]}x{grid[1]}"' in svg
    assert svg.count(">42<") == n and "url(#" not in svg.split("</defs>")[1]
    verdict[0] = Verdict.STALE
    stale = one(far, verdict, grid, chosen=0)
    assert "url(#zone-hatch)" in stale and css(POINT[Verdict.STALE]) in stale
    far[:] = np.nan
    assert ">42<" not in one(far, np.full(n, Verdict.NO_TARGET, np.uint8), grid)


def test_the_scale_names_every_reason_for_which_a_point_is_thrown_away():
    words = scale()
    for verdict in POINT:
        said = verdict.name.lower().replace("_", " ")
        assert (said in words) == (verdict is not Verdict.KEPT)


def test_who_cannot_see_comes_first_then_who_is_not_well_then_who_was_spoiled(engine):
    health = np.full(SENSORS, SensorHealth.GOOD, dtype=np.uint8)
    now = snapshot(engine, health=health, unable=np.zeros(SENSORS, dtype=np.uint8))
    owner = engine.skin.sensor_of
    assert worst_first(now, owner) == [0, 1] and dots(now) == ["", ""]
    spoiled = replace(now, spoiled=((1, "noisy"),))
    assert worst_first(spoiled, owner) == [1, 0] and dots(spoiled) == ["", css(GHOST)]
    blind = replace(now, unable=np.array([0, Unable.SILENT], dtype=np.uint8))
    assert worst_first(blind, owner) == [1, 0] and dots(blind) == ["", css(ALARM)]
    bad = now.cloud.verdict.copy()
    bad[64:80] = Verdict.BAD_STATUS
    assert worst_first(replace(now, cloud=replace(now.cloud, verdict=bad)), owner) == [1, 0]


def test_a_click_on_a_map_shows_the_sensor_its_cone_and_what_is_known_of_it(page, seen):
    seen(real=None)
    assert page.skin.choice.value == NO_SENSOR and not page.skin.facts.visible
    run(page, page.skin.map_buttons, "s1")
    seen()
    assert page.chosen.sensor == 1 and page.skin.choice.value == "s1"
    assert page.server.scene.get_handle_by_name("/robot/forearm_link/chosen") is not None
    facts = page.skin.facts.content
    for words in ("2.0 mm, 0.50 deg", "45 x 45 deg, 8 x 8 zones", "15.0 of 15", "30 ms", "1 self"):
        assert words in facts
    assert 'data-zones="8x8"' in page.skin.zones.content and page.skin.zone_buttons.visible
    run(page, page.skin.choice, NO_SENSOR)
    seen()
    assert page.server.scene.get_handle_by_name("/robot/forearm_link/chosen") is None


def test_a_click_on_a_zone_tells_its_verdict_and_shows_its_point(page, seen):
    run(page, page.skin.map_buttons, "s1")
    run(page, page.skin.zone_buttons, "7")
    now = seen()
    assert page.chosen.slot == 70
    assert "s1, row 1, column 7" in page.skin.words.content
    assert "The arm itself: it hit the base" in page.skin.words.content
    assert page.clicked.ball.visible and page.clicked.label.text.startswith("the arm itself")
    np.testing.assert_allclose(page.clicked.ball.position, now.cloud.points[70])
    run(page, page.skin.zone_buttons, "8")  # nothing came back there
    seen()
    assert "Nothing came back" in page.skin.words.content and not page.clicked.ball.visible


def test_a_click_in_the_scene_finds_the_point_that_is_drawn_there(page, engine, seen):
    now, eye = seen(), np.array([3.0, -2.0, 1.0])
    there = now.cloud.points[3]
    page.chosen.click(eye, there - eye, now, {Verdict.KEPT})
    assert (page.chosen.sensor, page.chosen.slot) == (0, 3)
    page.chosen.click(eye, there - eye, now, {Verdict.SELF})
    assert page.chosen.slot == NOBODY
    page.chosen.click(eye, np.array([0.0, 0.0, 1.0]), now, set(Verdict))
    assert (page.chosen.sensor, page.chosen.slot) == (
        0,
        NOBODY,
    )  # nothing is near: the sensor stays
    page.chosen.click(eye, np.zeros(3), now, set(Verdict))


def test_what_is_done_to_a_sensor_is_asked_of_the_plant(page, engine, seen):
    seen()
    assert not page.skin.spoil.visible  # nobody is chosen
    run(page, page.skin.spoil, OFF)
    assert engine.posted == []
    run(page, page.skin.map_buttons, "s1")
    seen()
    assert page.skin.spoil.visible and not page.skin.feed.visible
    run(page, page.skin.spoil, OFF)
    assert engine.posted == [SpoilSensor(1, OFF)]
    seen(spoiled=((1, OFF),))
    assert "good (off, by a person)" in page.skin.facts.content


@pytest.mark.parametrize("word", ["real", "simulated"])
def test_a_sensor_of_a_mixed_skin_is_fed_from_where_a_person_says(page, engine, seen, word):
    run(page, page.skin.map_buttons, "s1")
    seen(real=np.array([True, False]))
    assert page.skin.feed.visible and "simulated" in page.skin.facts.content
    run(page, page.skin.feed, word)
    assert engine.posted == [UseSensor("s1", word == "real")]


def test_the_worst_come_first_when_a_person_wants_it(page, seen):
    blind = {"unable": np.array([0, Unable.SILENT], dtype=np.uint8)}
    seen(**blind)
    assert page.skin.map_buttons.options == ("s0", "s1")
    assert "1 cannot see" in page.skin.summary.content
    run(page, page.skin.worst, True)
    seen(**blind)
    assert page.skin.map_buttons.options == ("s1", "s0")
    run(page, page.skin.worst, False)
    assert page.skin.map_buttons.options == ("s0", "s1")


def test_health_tells_the_latency_and_every_port(skin):
    engine = SimpleNamespace(skin=skin, source="serial /dev/a")
    with serving(port=0) as server:
        panel = HealthPanel(server, engine, SimpleNamespace())
        now = SimpleNamespace(
            stamp=10.0, health=np.full(30, SensorHealth.GOOD), rate=np.full(30, 15.0),
            cloud=SimpleNamespace(stamp=np.full(30, 9.98)),
            delay=np.array([np.nan, *[0.02] * 28, 0.08]),
            inputs=(("/dev/a", "good · binary · 10 sensors"), ("/dev/<b>", "lost")),
        )  # fmt: skip
        rows = dict(panel._sensors(now))
    assert rows["measured to used, median / worst"] == "20 / 80 ms"
    assert rows["/dev/a"] == "good · binary · 10 sensors" and rows["/dev/&lt;b&gt;"] == "lost"
    assert latency(SimpleNamespace(delay=np.full(3, np.nan))) == "-"


def test_the_sheet_of_thirty_sensors_costs_a_few_milliseconds(skin):
    sheet, verdict = Sheet(skin), np.full(skin.slots, Verdict.KEPT, dtype=np.uint8)
    svg = sheet.svg(far_of(skin), verdict, [""] * skin.count, NOBODY)
    assert len(svg) < 40_000
