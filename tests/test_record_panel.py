"""Recording from the page: names that nobody can misuse, and what the panel says."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from app.config import Params
from app.messages import Mode, Status
from app.record.reader import open_recording
from app.record.recorder import Progress
from app.record.ring import Ring
from app.runtime import Engine
from app.setup import Setup
from app.timing import ManualClock
from app.ui.desk import Desk, Kept, file_stem
from app.ui.panels.record_panel import last_html, outcome_html, state_html, stop_reason
from app.wiring import build_engine

SETUP = Setup(scene="empty", world="ideal")


@pytest.fixture
def engine() -> Iterator[Engine]:
    engine = build_engine(SETUP, ManualClock(), Params())
    yield engine
    engine.close()


@pytest.fixture
def desk(engine: Engine, tmp_path: Path) -> Desk:
    ring = Ring(engine, SETUP, threaded=False)
    engine.follow(ring)
    return Desk(engine, SETUP, tmp_path / "new" / "recordings", ring)


def test_a_recording_begins_and_ends_in_the_folder_of_the_starter(
    engine: Engine, desk: Desk
) -> None:
    engine.step()
    desk.begin()
    desk.begin()  # pressed twice
    assert desk.progress is not None and desk.progress.path.parent == desk.folder
    for _ in range(20):
        engine.step()
    desk.end()
    assert desk.progress is None and desk.fault == ""
    assert desk.kept is not None and len(list(desk.folder.iterdir())) == 1
    with open_recording(desk.kept.path) as recording:
        assert recording.torn == "" and len(recording) == 19  # the first tells how it begins


def test_the_last_half_minute_is_kept_under_the_reason_of_the_stop(
    engine: Engine, desk: Desk
) -> None:
    for _ in range(10):
        engine.step()
    desk.save_last("stopped: ../../port /dev/ttyUSB0 is lost; <b>Größe</b>")
    assert desk.fault == "" and desk.kept is not None
    assert desk.kept.path.parent == desk.folder
    assert desk.kept.path.name.endswith("Z_stopped-port-dev-ttyusb0-is-lost-b-groe-b.mcap")
    with open_recording(desk.kept.path) as recording:
        assert len(recording) == 10


def test_two_files_of_one_second_have_two_names(engine: Engine, desk: Desk) -> None:
    for _ in range(5):
        engine.step()
    for _ in range(3):
        desk.save_last()
        assert desk.fault == ""
    assert len(list(desk.folder.iterdir())) == 3


def test_a_wish_that_cannot_be_fulfilled_says_why(engine: Engine, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    desk = Desk(engine, SETUP, tmp_path / "file" / "below", Ring(engine, SETUP, threaded=False))
    desk.begin()
    assert "--recordings DIR" in desk.fault and desk.progress is None
    desk = Desk(engine, SETUP, tmp_path / "free", Ring(engine, SETUP, threaded=False))
    desk.save_last()
    assert "nothing to save" in desk.fault


def test_a_name_holds_its_time_and_only_plain_letters() -> None:
    assert file_stem(1_764_235_930.0) == "2025-11-27_09-32-10Z"
    for reason in ("..", "/etc/passwd", "a\0b", "con:", "日本", "x" * 500):
        stem = file_stem(0.0, reason)
        assert set(stem) <= set("abcdefghijklmnopqrstuvwxyz0123456789-_Z") and len(stem) < 90


def test_a_stop_that_a_person_wanted_is_no_fault() -> None:
    stopped = Status(Mode.STOPPED, "port is lost", 0.0)
    assert stop_reason(stopped) == "stopped: port is lost"
    assert stop_reason(replace(stopped, reason="asked for by a person at page 1")) == ""
    assert stop_reason(replace(stopped, mode=Mode.HOLDING)) == ""


def test_the_panel_tells_size_time_losses_and_a_sudden_end() -> None:
    progress = Progress(Path("rec/a<b>.mcap"), 4_200_000, 12.4, 3100, 0, "")
    told = state_html(progress, Path("rec"))
    assert "12 s, 4.2 MB, nothing dropped" in told and "a&lt;b&gt;.mcap" in told
    assert "7 ticks dropped" in state_html(replace(progress, dropped=7), Path("rec"))
    assert "Ended by itself" in state_html(replace(progress, fault="disk full"), Path("rec"))
    assert "rec/" in state_html(None, Path("rec"))


def test_the_panel_tells_what_can_be_kept_and_how_to_see_it_again() -> None:
    assert "save it now" in last_html("stopped: x", 5.0, 30.0)
    assert "older" in last_html("stopped: x", 50.0, 35.0)
    assert "30 s are at hand" in last_html("", 0.0, 30.0)
    assert "flinch replay rec/a.mcap" in outcome_html(Kept(Path("rec/a.mcap"), 3.0), "")
    assert "Not done: full" in outcome_html(None, "full")
