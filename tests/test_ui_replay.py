"""The page of a recording without a browser: what it shows, and that every view follows a step."""

import asyncio
from types import SimpleNamespace

import pytest

from app.messages import Mode
from app.record.kept import Kept
from app.replay.made import player_of
from app.timing import ManualClock
from app.ui.panels.replay_panel import SPEEDS, bar_marks
from app.ui.replay_page import ReplayPage, banner_html
from app.ui.server import close_page
from tests.recorded_run import kept_run


@pytest.fixture(scope="module")
def built():
    clock = ManualClock(100.0)
    run = kept_run(2.0)
    torn = Kept(run.head, run._ticks, run._bodies)
    torn.torn = "killed <while> it was written"
    player, survey = player_of(torn, clock, {"mode": "wb"}, "recorded, run.mcap")
    page = ReplayPage(player, survey, port=0, clock=clock)
    yield page, player, clock
    close_page(page.server)


@pytest.fixture
def page(built):
    page, player, clock = built
    clock.t += 10.0
    player.pause()
    go(page, player, 0)
    return page


@pytest.fixture
def player(built):
    return built[1]


@pytest.fixture
def clock(built):
    return built[2]


def go(page, player, i):
    player.seek(i)
    player.turn()
    page.pump.step()


def by(handle, client):
    return SimpleNamespace(client_id=client, client=None, target=handle)


def change(page, handle, value, client=0):
    handle._impl.value = value
    for callback in handle._impl.update_cb:
        call = callback(by(handle, client))
        asyncio.run_coroutine_threadsafe(call, page.server.get_event_loop()).result(5.0)


def test_a_step_of_one_tick_is_shown_by_every_view_however_seldom_they_look(page, player):
    go(page, player, 120)
    assert "Running" in page.panel.state.content or "Stopped" in page.panel.state.content
    go(page, player, 119)
    before = page.panel.state.content
    go(page, player, 120)  # the stop is asked for here
    assert page.panel.state.content != before and "Stopped" in page.panel.state.content
    go(page, player, 79)
    assert "0.25 m" in page.settings.table.content
    go(page, player, 80)
    assert "<b>0.3 m</b>" in page.settings.table.content


def test_the_bar_and_the_words_follow(page, player):
    go(page, player, 125)
    assert page.panel.bar.value == pytest.approx(1.0)
    assert "1.000 of 1.992 s · tick 125" in page.panel.where.content


def test_a_hand_on_the_bar_seeks_and_the_page_itself_does_not(page, player):
    change(page, page.panel.bar, 0.8)
    assert player.wanted == 100
    player.turn()
    change(page, page.panel.bar, 0.4, client=None)
    assert player.wanted is None and player.at == 100


def test_marks_are_on_the_bar_and_in_the_list(page, player):
    recording = player.timeline.recording
    stop = next(m for m in recording.marks if m.kind == "stop")
    assert round(player.seconds(stop.tick), 3) in bar_marks(player, recording.marks)
    words = next(w for w in page.facts.marks.options if "stop:" in w)
    change(page, page.facts.marks, words)
    player.turn()
    assert player.at == stop.tick == 120
    page.panel.beside(-1)
    player.turn()
    assert player.at < 120
    page.panel.beside(1)
    player.turn()
    assert player.at == 120
    many = [m for m in recording.marks for _ in range(30)]
    assert bar_marks(player, many) == (pytest.approx(0.96),)


def test_the_speed_is_as_chosen(page, player):
    for words, speed in SPEEDS.items():
        change(page, page.speed, words)
        assert player.speed == speed
    change(page, page.speed, "1 x")


def test_it_says_what_it_is_and_why_it_ends_early(page, player):
    banner = banner_html(player.timeline.recording, player.timeline.mind.ghost)
    assert "nothing here moves an arm" in banner and "wb: where its command" in banner
    assert "killed &lt;while&gt;" in banner
    facts = page.facts.facts.content
    assert "killed &lt;while&gt;" in facts and "ur10e" in facts and "numpy" in facts


def test_a_replay_that_fails_is_told_on_the_page(page, player):
    player.fault = "the replay has failed: no more"
    page._still(2.0)
    assert "Failed" in page.panel.state.content and "no more" in page.panel.why.content
    player.fault = ""


def test_the_plots_fill_while_it_stands(page, player, clock):
    player.timeline.explore()
    clock.t += 1.0
    page._still(2.0)
    x, own, ghost, kept, here = page.plot.distance.data
    assert len(x) == len(own) == len(ghost) == len(kept) == len(here) == 20 + 3
    assert kept[-1] == pytest.approx(30.0) and own[5] < 100.0
    assert "through" not in page.facts.survey.content


def test_playing_shows_that_it_plays(page, player, clock):
    player.play()
    clock.t += 0.4
    player.turn()
    page.pump.step()
    assert page.panel.play.label == "Pause" and player.at == 50
    player.pause()
    page._still(1.5)
    assert page.panel.play.label == "Play"
    assert player.snapshots.get()[0].status.mode is Mode.RUNNING
