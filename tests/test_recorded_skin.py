"""The frames of a recorded run, said again to a live brain."""

import numpy as np
import pytest

from app.errors import SensorError
from app.record.head import head_of
from app.record.recorder import start_recording
from app.replay.skin import RecordedSkin, places, recorded_skin
from app.robot.skin_file import load_skin
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine
from tests.recorded_run import kept_run

SIDE = Setup(scene="side-panel", rate=125.0, seed=3, world="ideal")


@pytest.fixture(scope="module")
def run():
    return kept_run(1.0, SIDE, {})


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    engine = build_engine(SIDE, ManualClock())
    for i in range(150):
        if i == 50:  # it moves by then
            start_recording(engine, SIDE, path, threaded=False, views=False)
        engine.step()
    engine.close()
    return path


def test_every_sensor_says_what_it_said_when_it_said_it(run, skin, robot):
    source = RecordedSkin("run.mcap", run, skin, skin)
    posture, said, began = robot.posture(robot.home), [], 1000.0
    for x in (run.inputs(i) for i in range(len(run))):
        now = began + x.now - float(run.times[0])
        frames = source.poll(now, posture)
        assert [f.sensor for f in frames] == [f.sensor for f in x.frames]
        for f, was in zip(frames, x.frames, strict=True):
            assert f.distance is was.distance and f.sequence == was.sequence
            assert now - f.stamp == pytest.approx(x.now - was.stamp)
        said += frames
    assert {f.sensor for f in said} == set(range(skin.count))
    assert source.connected.all() and "has ended" in source.ended()


def test_polled_seldom_it_leaves_out_nothing(run, skin, robot):
    source, posture = RecordedSkin("run.mcap", run, skin, skin), robot.posture(robot.home)
    source.poll(0.0, posture)
    frames = source.poll(0.5, posture)
    due = sum(len(run.inputs(i).frames) for i in range(1, 63))
    assert len(frames) == due


def test_a_file_plays_into_a_live_brain_from_the_posture_that_it_was_seen_from(file):
    setup = Setup(scene="empty", rate=125.0, sensors=f"replay:{file}")
    engine = build_engine(setup, ManualClock())
    first = engine.plant._source._inner.posture
    assert np.array_equal(engine.step().joints.q, first)
    assert np.abs(first - engine.robot.home).max() > 1e-3
    for _ in range(40):
        s = engine.step()
    assert s.status.mode == "running" and s.body.minimum < 0.6 and s.world == ()
    assert "run.mcap" in engine.source
    for _ in range(120):
        s = engine.step()
    assert s.status.mode == "stopped" and "has ended" in s.status.reason
    engine.close()


def test_one_sensor_may_be_played_alone_and_the_rest_simulated(file):
    setup = Setup(scene="empty", rate=125.0, sensors=f"replay:{file}@ring1-03+simulated")
    engine = build_engine(setup, ManualClock())
    for _ in range(20):
        s = engine.step()
    k = engine.skin.index("ring1-03")
    assert s.real.sum() == 1 and s.real[k]
    engine.close()


def test_a_skin_without_such_a_sensor_is_refused_by_its_name(skin, robot):
    sparse = load_skin(robot.folder / "skin/sparse-4x4.toml", robot)
    with pytest.raises(SensorError, match=f"{skin.sensors[0].name} cannot play on .* --skin"):
        places(skin, sparse, "")
    with pytest.raises(SensorError, match=f"did you mean '{skin.sensors[0].name}'"):
        places(skin, skin, skin.sensors[0].name + "x")
    assert places(skin, skin, "") == {k: k for k in range(skin.count)}


def test_what_is_not_a_recorded_run_is_left_to_others(skin):
    for sensors in ("simulated", "replay:/folder", "serial:/dev/ttyACM0"):
        assert recorded_skin(Setup(sensors=sensors), skin) is None


def test_a_fault_of_the_recorded_ports_is_said_again(run, skin, robot):
    from dataclasses import replace

    from app.record.kept import Kept

    ticks = list(run._ticks)
    x, out = ticks[20]
    ticks[20] = replace(x, source=replace(x.source, fault="port A is lost")), out
    engine = build_engine(SIDE, ManualClock())
    source = RecordedSkin("r", Kept(head_of(SIDE, engine), ticks), skin, skin)
    posture = robot.posture(robot.home)
    source.poll(0.0, posture)
    assert source.fault(0.0, 0.5, source.connected) == ""
    source.poll(float(run.times[20] - run.times[0]), posture)
    assert source.fault(0.0, 0.5, source.connected) == "port A is lost"
