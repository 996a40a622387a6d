"""Plants: every one is bounded by the cell, and what fails in one is a stop with a name."""

import json
import logging

import numpy as np
import pytest

from app.actions import (
    AddObstacle,
    ForgetBackground,
    KeepBackground,
    LearnBackground,
    MoveObstacle,
    SetGoal,
    SetMode,
    SetParams,
    UseSensor,
)
from app.cell.files import load_cell
from app.cli import main
from app.config import Params
from app.errors import ConfigError
from app.judge.truth import TrueDistance
from app.messages import Mode
from app.robot.arm import SimulatedArm
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.timing import ManualClock, WallClock
from app.wiring import assemble, build_engine
from app.world.world import World
from tests.test_brain import Bench, beside_the_forearm

GROUND = 'title = "g"\n[[plane]]\nname = "ground"\nposition_m = [0.0, 0.0, 0.0]\n'


def recording_of_an_empty_room(folder, seconds=30):
    lines = []
    for i in range(seconds * 15):
        lines += [f"{1000 + 67 * i},0,0"] + ["0,0,255"] * 64
    (folder / "state_ToF.csv").write_text("\n".join(lines))
    return f"replay:{folder}@ring2-03"


def lowest(engine, snapshot):
    moving = np.flatnonzero(engine.robot.supports.any(axis=1))
    T = snapshot.T_base_link
    return min((engine.robot.bodies[i].vertices @ T[i][2, :3]).min() + T[i][2, 3] for i in moving)


@pytest.mark.parametrize("mode", ["qp", "wb", "multi", "sm"])
def test_a_replayed_skin_has_a_table_too_whatever_the_controller(tmp_path, mode):
    (tmp_path / "cell.toml").write_text(GROUND)
    setup = Setup(
        sensors=recording_of_an_empty_room(tmp_path), cell=str(tmp_path / "cell.toml"), rate=100.0
    )
    engine = build_engine(setup, ManualClock(), Params(mode=mode, goal_speed=0.6))
    T = np.array(engine.step().T_base_tool)
    T[2, 3] = -0.3
    engine.post(SetGoal(T))
    least, nearest = np.inf, np.inf
    for _ in range(1000):
        s = engine.step()
        least = min(least, lowest(engine, s))
        nearest = min(nearest, s.T_base_tool[2, 3])
    assert s.status.mode is Mode.RUNNING
    assert least >= 0.0 and nearest < 0.1  # it came down as far as it may


def test_the_scenes_cell_is_every_plants_unless_another_is_named(tmp_path):
    sensors = recording_of_an_empty_room(tmp_path, 1)
    names = build_engine(Setup(sensors=sensors), ManualClock()).cell.names
    assert "table" in names and "door panel" in names
    (tmp_path / "cell.toml").write_text(GROUND)
    for kind in (sensors, "simulated"):
        own = Setup(sensors=kind, cell=str(tmp_path / "cell.toml"))
        assert build_engine(own, ManualClock()).cell.names[0] == "ground"
    assert build_engine(Setup(cell="bench"), ManualClock()).cell.title == "A wide bench"


def test_an_arm_that_may_move_needs_a_cell_of_its_own(capsys):
    with pytest.raises(ConfigError, match="--cell FILE"):
        Setup(driver="ur:127.0.0.1", armed=True)
    assert main(["run", "--driver", "ur:127.0.0.1", "--arm", "--no-open"]) == 1
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and "--cell" in err


def test_a_cell_that_is_not_there_is_one_line(capsys):
    assert main(["run", "--headless", "--cell", "moon"]) == 1
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and "bench" in err


def posted(engine, seconds, *actions):
    for action in actions:
        engine.post(action)
    for _ in range(round(seconds / engine.ticker.period)):
        snapshot = engine.step()
    return snapshot


def written(engine):
    """Wait until the keeper has done what it was given."""
    for follower in engine._followers:
        follower._pool.submit(int).result()


def test_what_is_learned_is_a_preview_then_known_kept_in_the_file_and_forgotten(tmp_path):
    file = tmp_path / "cell.toml"
    file.write_text(GROUND)
    engine = build_engine(Setup(scene="front-panel", cell=str(file), rate=100.0), ManualClock())
    posted(engine, 0.5, SetMode(Mode.STOPPED))
    learning = posted(engine, 1.0, LearnBackground(2.0))
    assert 0.9 < learning.background.left < 1.1
    seen = posted(engine, 1.5)
    assert len(seen.background.preview) > 20 and len(seen.background.known) == 0
    assert not seen.notice.refused and "keep or discard" in seen.notice.words
    assert seen.body.closest >= 0  # a preview changes nothing yet
    kept = posted(engine, 0.5, KeepBackground())
    assert len(kept.background.known) == len(seen.background.preview)
    assert len(kept.background.preview) == 0
    written(engine)
    assert len(load_cell(file).learned) == len(kept.background.known)
    assert file.read_text().startswith(GROUND)
    told = posted(engine, 0.1)
    assert "are kept in" in told.notice.words and not told.notice.refused
    assert len(posted(engine, 0.1, ForgetBackground()).background.known) == 0


def test_a_background_that_cannot_be_written_is_a_notice_and_the_arm_goes_on(tmp_path):
    engine = build_engine(
        Setup(scene="front-panel", background=tmp_path / "no" / "b.toml", rate=100.0),
        ManualClock(),
    )
    posted(engine, 2.5, LearnBackground(2.0))
    posted(engine, 0.1, KeepBackground())
    written(engine)
    told = posted(engine, 0.1)
    assert told.notice.refused and "cannot be written" in told.notice.words
    assert told.status.mode is Mode.RUNNING and len(told.background.known) > 0


@pytest.mark.slow
def test_a_learned_post_bounds_the_motion_that_it_no_longer_holds_back(robot, skin):
    bench = Bench(robot, skin, rate=100.0)
    place = beside_the_forearm(robot, bench.run(0.2), 0.40)
    post = AddObstacle("post", {"kind": "box", "size_m": [0.1, 0.1, 0.8]}, place)
    bench.run(0.5, post, SetMode(Mode.HOLDING))
    learned = bench.run(3.2, LearnBackground(3.0))
    assert len(learned.background.preview) > 10
    # its upper end was seen only before it was learned, and is remembered as an obstacle
    at_rest = bench.run(0.5, KeepBackground(), SetParams({"memory": False}))
    assert at_rest.body.minimum > 0.4  # it holds nothing back any more
    T = np.array(at_rest.T_base_tool)
    T[:3, 3] = place  # in the middle of the post
    truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
    bench.run(0.01, SetGoal(T), SetMode(Mode.RUNNING))
    true = []
    for _ in range(500):
        s = bench.run(0.01)
        true.append(truth.measure(s.T_base_link, bench.world).min())
    assert 0.0 < min(true) < 0.1  # it came near and stayed off
    assert s.body.minimum > 0.3  # and not for what was seen of it


# --- what people and devices can do to it -----------------------------------------------------


@pytest.mark.parametrize(
    "action",
    [
        AddObstacle("x", {"kind": "sphere", "radius_m": 0.1}, None),
        AddObstacle("x", None, (0, 0, 0)),
        MoveObstacle(None, None),
        LearnBackground("3"),
        LearnBackground(float("nan")),
        LearnBackground(0),
        SetParams(None),
        SetParams({"distance_kept": "near"}),
        SetGoal(None),
        SetMode("flying"),
        UseSensor(None, True),
        KeepBackground(),
        "no action at all",
    ],
)
def test_whatever_is_in_an_action_is_a_notice_and_never_the_end_of_the_thread(robot, skin, action):
    bench = Bench(robot, skin)
    before = bench.run(0.2)
    after = bench.run(0.02, action)
    assert after.notice.refused and after.notice.words
    assert after.status.mode is Mode.RUNNING and after.params == before.params
    assert not bench.run(0.02, SetParams({"distance_kept": 0.2})).notice.refused


def test_an_engine_starts_again_after_a_stop(robot, skin):
    world, clock = World(()), WallClock()
    eye = SimulatedSkin(robot, skin, world, 0, ErrorModel(ideal=True))
    engine = assemble(robot, skin, SimulatedArm(robot), eye, world, clock)
    for _ in range(2):
        engine.start()
        begin = engine.ticker.lateness.maxlen and engine.snapshots.get()[0]
        tick = begin.tick if begin else -1
        while (last := engine.snapshots.get()[0]) is None or last.tick < tick + 20:
            clock.sleep_until(clock.now() + 0.005)
        engine.stop()
        still = engine.snapshots.get()[0].tick
        assert engine.snapshots.get()[0].tick == still
    engine.close()


class BrokenArm(SimulatedArm):
    """Fails where it is told to."""

    fails = ""

    def send(self, qd, dt):
        if self.fails == "send":
            raise OSError("the wire is cut")
        return super().send(qd, dt)

    def state(self, now):
        if self.fails == "state":
            raise OSError("the wire is cut")
        return super().state(now)


@pytest.mark.parametrize("where", ["send", "state"])
def test_an_arm_that_fails_in_a_call_is_a_stop_with_its_words(robot, skin, where, caplog):
    arm = BrokenArm(robot)
    bench = Bench(robot, skin, arm)
    bench.run(0.2)
    arm.fails = where
    with caplog.at_level(logging.ERROR):
        stopped = bench.run(0.5)
    assert stopped.status.mode is Mode.STOPPED and "the wire is cut" in stopped.status.reason
    assert 1 <= len(caplog.records) <= 2  # not once a tick
    arm.fails = ""
    bench.run(0.02)
    assert bench.run(0.5, SetMode(Mode.RUNNING)).status.mode is Mode.RUNNING


def test_json_of_a_run_below_the_table_tells_its_lowest_point(tmp_path, capsys):
    (tmp_path / "cell.toml").write_text(GROUND)
    code = main(
        ["run", "--headless", "--seconds", "0.5", "--cell", str(tmp_path / "cell.toml"), "--json"]
    )
    row = json.loads(capsys.readouterr().out)["rows"][0]
    assert code == 0 and row["lowest_point_m"] > 0.0


def test_the_control_thread_goes_before_ordinary_ones_where_the_system_lets_it(robot, skin):
    import os
    import threading

    from app.timing import prefer_this_thread

    found = []

    def look():
        found.append((prefer_this_thread(), os.sched_getscheduler(0)))
        child = threading.Thread(target=lambda: found.append(os.sched_getscheduler(0)))
        child.start()
        child.join()

    thread = threading.Thread(target=look)
    thread.start()
    thread.join()
    (granted, policy), inherited = found
    assert granted == (policy & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR)
    assert inherited == os.SCHED_OTHER
    assert os.sched_getscheduler(0) == os.SCHED_OTHER  # of this thread
