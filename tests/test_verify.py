"""Verification: the same to the last bit, or the first tick and field that is not."""

import json
from dataclasses import replace

import pytest

from app.record.fingerprint import Fingerprint
from app.record.kept import Kept
from app.replay.verify import verify
from tests.recorded_run import ACTIONS, kept_run


@pytest.fixture(scope="module")
def run():
    return kept_run(2.0)


class Elsewhere(Kept):
    """The same, as if another machine had recorded it, with other last bits."""

    off = 1e-13

    def __init__(self, run):
        head = replace(run.head, fingerprint=replace(run.head.fingerprint, processor="abacus"))
        super().__init__(head, run._ticks)

    def witness(self, i):
        w = super().witness(i)
        return replace(w, digests={}, qd=w.qd + self.off * (i > 30))


def test_a_recording_is_computed_again_to_the_last_bit(run):
    said = []
    verdict = verify(run, lambda done, of: said.append((done, of)))
    assert verdict.ok and verdict.exact and verdict.notes == ()
    assert verdict.to_text() == "ok: 250 of 250 ticks are the same to the last bit"
    assert said[-1] == (250, 250)


def test_a_changed_constant_is_found_at_its_first_tick_and_field(run, monkeypatch):
    monkeypatch.setattr("app.control.bounds.pairs.XI", 0.5)
    verdict = verify(run)
    assert not verdict.ok and verdict.exact
    d = verdict.difference
    assert d.field == "command" and 0 < d.tick < 250
    assert d.expected != d.got
    assert f"differs at tick {d.tick}" in verdict.words and "in command" in verdict.words
    assert json.loads(verdict.to_json())["difference"]["fields"][0] == "command"


def test_another_machine_is_allowed_its_last_bits_and_no_more(run, monkeypatch):
    other = Elsewhere(run)
    verdict = verify(other)
    assert verdict.ok and not verdict.exact
    assert "rad/s" in verdict.words and verdict.notes == ("this is another processor",)
    other.off = 0.03
    verdict = verify(other)
    assert verdict.difference.tick == 31 and verdict.difference.field == "command"


def test_ticks_that_are_missing_end_the_comparison_with_a_word(run):
    gap = Kept(run.head, run._ticks[:100] + run._ticks[103:])
    verdict = verify(gap)
    assert verdict.ok and verdict.ticks == 100
    assert "3 ticks are missing after tick 99" in verdict.notes[0]


def test_a_torn_recording_is_verified_as_far_as_it_goes(run):
    torn = Kept(run.head, run._ticks[:50])
    torn.torn = "killed while it was written"
    verdict = verify(torn)
    assert verdict.ok and verdict.of == 50 and "killed" in verdict.to_text()


def test_a_clip_from_the_middle_of_a_run_begins_with_the_state_of_then():
    from app.replay.brain_of import brain_of

    run = kept_run(1.6, actions={**ACTIONS})
    brain = brain_of(run.head)
    for i in range(100):
        brain.tick(run.inputs(i))
    state = brain.written(brain.capture())
    clip = Kept(run.head.beginning(100, state, run.head.began), run._ticks[100:])
    verdict = verify(clip)
    assert verdict.ok and verdict.ticks == 100
    without = Kept(run.head.beginning(100, None, run.head.began), run._ticks[100:])
    assert verify(without).difference.tick == 100


def test_every_kind_of_version_is_told(run):
    then = Fingerprint((("numpy", "1.0"),), *["x"] * 4)
    words = run.head.fingerprint.differences(then)
    assert any(w.startswith("numpy") and "instead of 1.0" in w for w in words)
