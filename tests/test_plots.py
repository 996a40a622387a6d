"""The tab of the plots: what its curves hold, what the strip says, what is kept of them."""

import csv
import io
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.config import Params
from app.messages import Command, Mode, Status, Timing
from app.near import NOT_NEAR, NOTHING_NEAR, Nearness
from app.ui.curves import BLOCKED, FREE, LENGTH, PUSHED, SLOWED, STOPPED, Said, said
from app.ui.panels.plot_panel import CEILING, JUMP, PICTURE, STRIP, short, strip_html
from tests.ui_page import (  # noqa: F401 - fixtures
    run,
    show,
    snapshot,
    the_built,
    the_clock,
    the_engine,
    the_page,
)

HERE = (np.zeros(3), np.ones(3), np.array([1.0, 0.0, 0.0]))


def near(distance, link=3):
    return replace(
        NOT_NEAR, link=link, distance=distance, on_robot=HERE[0], on_world=HERE[1], normal=HERE[2]
    )


def test_what_can_give_way_and_what_cannot_are_two_curves(page, engine):
    both = Nearness(yields=near(0.27), stays=near(0.09, 2))
    for _ in range(3):
        show(page, engine, snapshot(engine, nearness=both))
    x, can, cannot, kept, begins, ghost, separation = page.plot.distance.data
    assert len(x) == LENGTH and x[-2:] == pytest.approx([-1.0, 0.0])
    assert (np.diff(x) > 0.0).all()
    now = (can[-1], cannot[-1], kept[-1], begins[-1])
    assert now == pytest.approx((27.0, 9.0, 25.0, 60.0))
    assert np.isnan(ghost).all() and np.isnan(separation).all()  # neither is in use


def test_an_empty_sky_is_drawn_at_the_top(page, engine):
    show(page, engine, snapshot(engine, nearness=NOTHING_NEAR))
    assert page.plot.distance.data[1][-1] == CEILING
    assert np.isnan(page.plot.distance.data[2][-1])  # there is nothing that cannot give way


def test_a_setting_that_is_changed_changes_no_past(page, engine):
    show(page, engine, snapshot(engine, params=Params(distance_kept=0.2, avoidance_begins=0.5)))
    show(page, engine, snapshot(engine, params=Params(distance_kept=0.3, avoidance_begins=0.7)))
    assert page.plot.distance.data[3][-2:] == pytest.approx([20.0, 30.0])
    assert page.plot.distance.data[4][-2:] == pytest.approx([50.0, 70.0])


def test_speeds_are_shares_of_the_joints_limits_as_they_were_allowed(page, engine):
    now = snapshot(engine, params=Params(joint_speed=0.4))
    qd = 0.25 * engine.robot.qd_max * [1, -1, 1, 0, 0, 0]
    show(page, engine, replace(now, joints=replace(now.joints, qd=qd)))
    _, *joints, allowed = page.plot.speed.data
    assert [c[-1] for c in joints] == pytest.approx([25.0, 25.0, 25.0, 0.0, 0.0, 0.0])
    assert allowed[-1] == pytest.approx(40.0)
    assert short("shoulder_pan_joint") == "shoulder pan" and short("joint") == "joint"


def test_no_jump_and_no_long_tick_is_lost_between_two_rows(page, engine):
    now = snapshot(engine)
    show(page, engine, now)
    for i, (jump, tick) in enumerate(((0.02, 0.001), (0.3, 0.007), (0.0, 0.001))):
        later = replace(
            now, stamp=now.stamp + 0.033 * (i + 1), tick=now.tick + i + 1, jump=jump,
            timing=Timing({"control": tick}, 0.0004, rate=250.0),
        )  # fmt: skip
        show(page, engine, later)
    last = replace(now, stamp=now.stamp + 1.0, tick=now.tick + 9)
    show(page, engine, last)
    assert page.plot.jump.data[1][-1] == pytest.approx(30.0)
    assert page.plot.tick.data[1][-1] == pytest.approx(7.0)
    show(page, engine, replace(last, stamp=last.stamp + 1.0, jump=2.0))
    assert page.plot.jump.data[1][-1] == JUMP


@pytest.mark.parametrize(
    ("command", "facts", "kind", "words"),
    [
        (Command(np.zeros(6)), {}, FREE, "Free"),
        (Command(np.zeros(6), activation=1.0), {"holder": 5, "held_at": 0.28}, SLOWED, "Slowed by"),
        (Command(np.zeros(6), activation=1.0, reference=0.1), {"holder": 5, "held_at": 0.2},
         PUSHED, "Pushed back by"),
        (Command(np.zeros(6), activation=1.0), {"blocked": 4.0, "to_go": 0.62}, BLOCKED, "Blocked"),
    ],
)  # fmt: skip
def test_the_strip_says_what_the_controller_does(engine, command, facts, kind, words):
    links = [str(link) for link in engine.robot.links]
    now = snapshot(engine, command=command, nearness=Nearness(**facts))
    assert said(now, links).kind == kind and said(now, links).words.startswith(words)
    stopped = replace(now, status=Status(Mode.STOPPED, "a port is lost", 0.0))
    assert said(stopped, links) == Said(STOPPED, "Stopped: a port is lost")
    assert kind in STRIP


def test_the_strip_joins_what_lasts_and_tells_its_words_to_the_mouse():
    html = strip_html([Said(FREE, "Free")] * 20 + [Said(SLOWED, "Slowed by <wrist>")] * 5)
    assert html.count("<rect") == 2
    assert f'x="{LENGTH - 25}" width="20"' in html and f'x="{LENGTH - 5}" width="5"' in html
    assert "<title>Slowed by &lt;wrist&gt;</title>" in html
    assert strip_html([]).count("<rect") == 0


def test_a_pause_keeps_the_picture_and_goes_on_counting(page, engine):
    show(page, engine, snapshot(engine, nearness=Nearness(yields=near(0.4))))
    run(page, page.plot.pause, True)
    try:
        show(page, engine, snapshot(engine, nearness=Nearness(yields=near(0.2))))
        assert page.plot.distance.data[1][-1] == pytest.approx(40.0)
    finally:
        run(page, page.plot.pause, False)
    show(page, engine, snapshot(engine, nearness=Nearness(yields=near(0.1))))
    assert page.plot.distance.data[1][-2:] == pytest.approx([20.0, 10.0])


def test_the_table_has_a_line_a_row_with_names_units_and_words(page, engine):
    moment = Nearness(yields=near(0.27))
    show(page, engine, snapshot(engine, nearness=moment))
    rows = list(csv.DictReader(io.StringIO(page.plot.curves.csv(engine.robot.joints))))
    assert float(rows[-1]["can_give_way_m"]) == 0.27 and rows[-1]["cannot_give_way_m"] == ""
    assert rows[-1]["controller"] == "Slowed by its own body or the cell"
    assert "speed_share_elbow_joint" in rows[-1] and None not in rows[-1]


def test_the_table_is_sent_to_the_page_that_asks_for_it(page, engine):
    sent = []
    client = SimpleNamespace(send_file_download=lambda name, data, **_: sent.append((name, data)))
    show(page, engine, snapshot(engine))
    (callback,) = page.plot.save._impl.update_cb
    event = SimpleNamespace(client_id=0, client=client, target=page.plot.save)
    with pytest.raises(StopIteration):
        callback(event).send(None)
    assert sent[0][0] == "flinch-plots.csv" and sent[0][1].startswith(b"time_s,can_give_way_m")


def test_the_picture_is_made_by_the_browser_with_nothing_that_ends_its_attribute():
    assert '"' not in PICTURE and "<" not in PICTURE and "toDataURL" in PICTURE
