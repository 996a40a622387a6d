"""The last half minute: always there, bounded, and replayed like any recording."""

import numpy as np
import pytest

from app.actions import AddObstacle, RemoveObstacle
from app.errors import RecordingError
from app.record.reader import open_recording
from app.record.ring import BLOCK, Ring
from tests.recorded import SETUP, Handing, new_engine, same_outputs

BALL = AddObstacle("ball", {"kind": "sphere", "radius_m": 0.08}, (0.5, 0.5, 0.5))


def names(recording, i):
    return [b.view.name for b in recording.bodies(i)]


def test_a_clip_replays_exactly_and_has_at_least_the_seconds_that_were_asked_for(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("app.record.ring.PART", 0.4)
    engine = new_engine()
    for _ in range(3):
        engine.step()
    ring = Ring(engine, SETUP, seconds=0.8, threaded=False)
    engine.follow(ring)
    asked = {40: BALL, 150: RemoveObstacle("ball")}
    lengths = {}
    for i in range(1, 240):
        if i in asked:
            engine.post(asked[i])
        engine.step()
        if i in (30, 100, 239):
            path = tmp_path / f"{i}.mcap"
            seconds = ring.save(path)
            with open_recording(path) as clip:
                lengths[i] = len(clip)
                assert clip.torn == "" and clip.dropped == 0
                assert seconds == pytest.approx((len(clip) - 1) / SETUP.rate)
                assert clip.inputs(len(clip) - 1).tick == i + 2  # nothing newer is missing
                assert same_outputs(clip, engine.brain.sibling("qp")) == []
                assert ("ball" in names(clip, len(clip) - 1)) == (i == 100)
                first = clip.inputs(0).tick
                if first // 10 not in (4, 15):  # not as it came or went
                    assert ("ball" in names(clip, 0)) == (45 < first < 150)
    assert lengths[30] == 29  # the first tick that it saw was over
    assert 100 <= lengths[239] <= 160


def test_a_clip_of_a_run_that_has_just_begun_has_no_state(tmp_path):
    engine = Handing()
    ring = Ring(engine, SETUP, threaded=False)
    engine.follow(ring)
    with pytest.raises(RecordingError, match="nothing to save"):
        ring.save(tmp_path / "none.mcap")
    engine.hand(20)
    ring.save(tmp_path / "run.mcap")
    with open_recording(tmp_path / "run.mcap") as clip:
        assert clip.head.first_tick == 0 and clip.head.state is None and len(clip) == 20
    with pytest.raises(RecordingError, match="exists already"):
        ring.save(tmp_path / "run.mcap")


def test_a_ring_never_holds_more_than_its_seconds_and_a_part(monkeypatch):
    monkeypatch.setattr("app.record.ring.PART", 1.0)
    engine = Handing()
    ring = Ring(engine, SETUP, seconds=3.0, threaded=False)
    engine.follow(ring)
    held, sizes = [], []
    for _ in range(24):
        engine.hand(round(0.7 * SETUP.rate))
        ring._worker.drain()
        held.append(ring.held)
        sizes.append(sum(len(b) for p in ring._parts for b in p.blocks))
    assert max(held) <= 3.0 + 1.0 + BLOCK + 0.1 and min(held[6:]) >= 3.0
    assert max(sizes[6:]) < 1.5 * min(sizes[6:]) and len(ring._looks) < 60


def test_a_ring_in_a_thread_of_its_own_gives_its_memory_back_and_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr("app.record.ring.PART", 0.2)
    engine = Handing()
    ring = Ring(engine, SETUP, seconds=0.5)
    engine.follow(ring)
    for _ in range(20):
        engine.hand(25)
        ring._worker.drain()
    ring.close()
    assert len(ring._free) == 2 and ring.fault == ""
    ring.save(tmp_path / "run.mcap")
    with open_recording(tmp_path / "run.mcap") as clip:
        ticks = [clip.inputs(i).tick for i in range(len(clip))]
        assert ticks[-1] == 499 and np.all(np.diff(ticks) == 1) and clip.dropped == 0
        assert clip.head.first_tick == ticks[0] > 300


def test_a_ring_that_fails_says_so_and_the_run_goes_on(tmp_path, monkeypatch):
    engine = Handing()
    ring = Ring(engine, SETUP, threaded=False)
    engine.follow(ring)
    monkeypatch.setattr(ring._scribe, "lines", None)
    engine.hand(70)
    assert "TypeError" in ring.fault
    with pytest.raises(RecordingError, match="nothing to save: TypeError"):
        ring.save(tmp_path / "run.mcap")
