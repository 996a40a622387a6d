"""Playing a recording: in its own time, by steps, from anywhere; on a clock that the test moves."""

import pytest

from app.actions import SetGoal, SetMode
from app.messages import Mode
from app.replay.made import player_of
from app.timing import ManualClock
from tests.recorded_run import kept_run


@pytest.fixture(scope="module")
def made():
    clock = ManualClock(50.0)
    player, survey = player_of(kept_run(2.0), clock, {}, "recorded, x.mcap")
    return player, survey, clock


@pytest.fixture
def player(made):
    player, _, _ = made
    player.pause()
    player.set_speed(1.0)
    player.seek(0)
    player.turn()
    return player


@pytest.fixture
def clock(made):
    return made[2]


def shown(player):
    snapshot, stamp = player.snapshots.get()
    assert snapshot.stamp == stamp
    return snapshot.tick


def test_it_stands_at_the_first_tick_until_it_is_played(player, clock):
    clock.t += 5.0
    player.turn()
    assert shown(player) == 0 and not player.playing


def test_it_plays_in_its_own_time_and_by_speed(player, clock):
    player.play()
    for _ in range(10):
        clock.t += 0.04
        player.turn()
    assert shown(player) == 50  # 0.4 s at 125 Hz
    player.set_speed(0.1)
    clock.t += 0.4
    player.turn()
    assert shown(player) == 55
    player.set_speed(4.0)
    clock.t += 0.1
    player.turn()
    assert shown(player) == 105
    player.set_speed(100.0)
    assert player.speed == 4.0


def test_a_pause_stays_and_play_goes_on_from_there(player, clock):
    player.play()
    clock.t += 0.2
    player.turn()
    player.pause()
    clock.t += 3.0
    player.turn()
    assert shown(player) == 25
    player.toggle()
    clock.t += 0.04
    player.turn()
    assert shown(player) == 30


def test_steps_go_a_tick_on_and_back_and_pause(player, clock):
    player.play()
    clock.t += 0.2
    player.turn()
    player.step(1)
    player.turn()
    assert shown(player) == 26 and not player.playing
    for _ in range(3):  # pressed faster than it is shown
        player.step(-1)
    player.turn()
    assert shown(player) == 23
    player.seek(0)
    player.step(-5)
    player.turn()
    assert shown(player) == 0


def test_a_seek_goes_anywhere_and_playing_goes_on_from_there(player, clock):
    player.seek_time(1.6)
    player.turn()
    assert shown(player) == 200
    player.play()
    player.seek_time(0.8)
    player.turn()
    clock.t += 0.08
    player.turn()
    assert shown(player) == 110 and player.playing
    player.seek(10**6)
    player.turn()
    assert shown(player) == player.last


def test_it_pauses_at_the_end_and_begins_anew(player, clock):
    player.seek(player.last - 5)
    player.turn()
    player.play()
    clock.t += 1.0
    player.turn()
    assert shown(player) == player.last and not player.playing
    player.play()
    player.turn()
    clock.t += 0.08
    player.turn()
    assert shown(player) == 10


def test_nothing_can_be_asked_of_the_arm_and_a_stop_pauses(player, clock):
    player.play()
    player.post(SetGoal(None))
    assert player.playing
    player.post(SetMode(Mode.STOPPED))
    assert not player.playing and player.programs == ()


def test_while_it_stands_the_rest_is_gone_through(made, player):
    _, survey, _ = made
    player.turn()
    assert survey.done


def test_a_slow_computer_plays_slower_and_leaves_out_nothing_that_is_decided():
    clock = ManualClock()
    player, _ = player_of(kept_run(1.0), clock, {})
    player.turn()
    player.play()
    tick = player.timeline.mind.tick

    def slowly(x):
        clock.t += 0.016  # twice as long as a tick is apart
        return tick(x)

    player.timeline.mind.tick = slowly
    began = clock.t
    while player.at < 60:
        player.turn()
        clock.t += 1e-3
    assert 0.8 < clock.t - began < 1.3  # for 0.48 s of the recording
    assert player.timeline.frontier >= 60


def test_a_replay_that_fails_says_so(caplog):
    player, _ = player_of(kept_run(0.2), ManualClock(), {})
    player.timeline.mind.tick = None
    player.start()
    player._thread.join(10.0)
    assert "has failed" in player.fault and not player.playing
    player.stop()
