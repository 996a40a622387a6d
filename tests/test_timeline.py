"""Any tick of a recording is computed again to the last bit, in whatever order it is asked for."""

import numpy as np
import pytest

from app.digest import digest
from app.replay.brain_of import brain_of
from app.replay.keyframes import Keyframes
from app.replay.made import mind_of
from app.replay.mind import Mind
from app.replay.survey import Survey, sampled
from app.replay.timeline import Timeline
from tests.recorded_run import kept_run


@pytest.fixture(scope="module")
def run():
    return kept_run()


@pytest.fixture(scope="module")
def told(run):
    """Digest of what came out of every tick when it ran."""
    return [digest(out) for _, out in run._ticks]


@pytest.fixture
def timeline(run):
    return Timeline(run, Mind(brain_of(run.head)), keep=20)


def test_forwards_backwards_and_by_jumps_every_tick_is_as_it_was(timeline, told):
    rng = np.random.default_rng(5)
    jumps = rng.integers(0, len(told), 12).tolist()
    for i in (0, 1, 2, 200, 199, 150, len(told) - 1, 3, 128, 127, *jumps):
        x, out = timeline.tick(i)
        assert x.tick == i and digest(out) == told[i], i


def test_a_step_back_over_what_is_at_hand_computes_nothing(timeline):
    timeline.tick(60)
    timeline.mind.tick = None
    assert timeline.tick(45)[0].tick == 45


def test_beyond_the_ends_there_is_nothing(timeline, told):
    for i in (-1, len(told)):
        with pytest.raises(IndexError):
            timeline.tick(i)


def test_what_is_interrupted_goes_on_where_it_was(timeline, told):
    calls = 0
    while not timeline.reach(100, lambda: True):
        calls += 1
        assert timeline.computed == calls - 1
    assert calls == 100 and digest(timeline.tick(100)[1]) == told[100]


def test_what_is_explored_in_between_disturbs_nobody(timeline, told):
    timeline.tick(30)
    survey = Survey(timeline)
    timeline.explore(lambda: timeline.frontier == 250)
    assert timeline.frontier == 250 and not survey.done
    assert digest(timeline.tick(31)[1]) == told[31]
    assert timeline.explore() and survey.done and survey.share == 1.0
    assert digest(timeline.tick(32)[1]) == told[32]


def test_a_survey_has_a_row_every_tenth_of_a_second(run):
    timeline = Timeline(run, mind_of(run, {"distance_kept": 0.4}))
    survey = Survey(timeline)
    assert np.isnan(survey.rows).all()
    timeline.explore()
    outs = [out for _, out in run._ticks]
    assert survey.time[:3] == pytest.approx([0.0, 0.104, 0.2])
    body = [outs[i].body.minimum for i in survey.at]
    assert survey.column("body").tolist() == body
    assert survey.column("kept")[-1] == pytest.approx(0.3)
    assert np.isfinite(survey.column("ghost_speed")).all()
    assert survey.column("ghost_apart").max() > 0.0


def test_rows_are_evenly_spread_whatever_the_rate():
    times = 5.0 + np.arange(1000) * 0.004
    assert np.diff(sampled(times)).tolist() == [25] * 39
    assert sampled(times, 0.0).tolist() == list(range(1000))


def test_keyframes_are_bounded_and_spread_out_and_some_are_near():
    frames = Keyframes(most=8, near=3, spacing=10)
    for i in range(0, 2000, 10):
        assert frames.due(i)
        frames.put(i, f"state {i}")
    assert len(frames) <= 11 and frames.spacing == 320
    assert frames.before(1999) == (1990, "state 1990")
    assert frames.before(700) == (640, "state 640")
    assert frames.before(5) == (0, "state 0")
    assert not frames.due(1990) and not frames.due(25, near=False)


def test_bodies_are_shown_where_they_were(timeline, run):
    seen = timeline.snapshot(200)
    assert {p.view.name for p in seen.world} >= {"ball"}
    assert seen.world is run.bodies(200) and seen.tick == 200
