"""Recordings as files: written beside a run, read as far as they go."""

import errno
import gc
import json
import os
import resource
import signal
import struct
import subprocess
import sys
import threading
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import Writer

from app.digest import digest
from app.errors import RecordingError
from app.messages import Mode
from app.record.head import FORMAT, head_of
from app.record.kept import Kept
from app.record.reader import open_recording
from app.record.recorder import ROOM, Recorder, start_recording, stop_recording
from app.record.ring import Ring
from app.record.run_file import INPUTS, TOPICS, WITNESS, RunFile
from app.record.witness import witness_of
from tests.recorded import SETUP, Handing, new_engine, run, same_outputs


def recorded(path, ticks=120, **how):
    """A finished recording of a handing engine."""
    engine = Handing()
    recorder = start_recording(engine, SETUP, path, threaded=False, views=False, **how)
    engine.hand(ticks)
    return stop_recording(engine, recorder)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The bytes of a recording of 500 ticks, 4 s, in eight pieces."""
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    recorded(path, 500)
    return path.read_bytes()


def test_what_is_read_is_what_was_there(tmp_path):
    path = tmp_path / "run.mcap"
    engine, ticks, snapshots = run()
    progress = recorded(path)
    assert (progress.ticks, progress.dropped, progress.fault) == (120, 0, "")
    assert progress.bytes == path.stat().st_size and progress.seconds == pytest.approx(119 / 125)
    with open_recording(path) as recording:
        assert len(recording) == 120 and recording.torn == "" and recording.dropped == 0
        for i, (x, out) in enumerate(ticks):
            assert digest(replace(recording.inputs(i), now=x.now)) == digest(x)
            assert digest(recording.witness(i)) == digest(witness_of(out))
        assert np.allclose(recording.times, np.arange(120) / 125, atol=1e-8)
        assert recording.head.fingerprint == head_of(SETUP, engine).fingerprint
        assert recording.head.first_tick == 0 and recording.head.state is None
        names = [b.view.name for b in recording.bodies(30)]
        assert names == [b.view.name for b in snapshots[30].world] and "ball" in names
        assert "ball" not in [b.view.name for b in recording.bodies(119)]
        for ours, theirs in zip(recording.bodies(0), snapshots[0].world, strict=True):
            assert np.array_equal(ours.T_base_body, theirs.T_base_body)
            assert np.array_equal(ours.view.vertices, theirs.view.vertices)
            assert np.array_equal(ours.view.faces, theirs.view.faces)
            assert ours.view.colour == theirs.view.colour


def test_a_recording_in_memory_says_the_same_as_its_file(tmp_path):
    path = tmp_path / "run.mcap"
    engine, ticks, snapshots = run()
    recorded(path)
    kept = Kept(head_of(SETUP, engine), ticks, [s.world for s in snapshots])
    with open_recording(path) as recording:
        assert recording.marks == kept.marks and len(kept) == len(recording)
        assert digest(recording.witness(7)) == digest(kept.witness(7))
        assert digest(recording.inputs(60).actions) == digest(kept.inputs(60).actions)
        assert kept.bodies(5) is snapshots[5].world
    assert [(m.tick, m.kind) for m in kept.marks if m.kind != "action"] == [
        (8, "mode"), (40, "mode"), (60, "controller"), (70, "stop"), (80, "mode"),
    ]  # fmt: skip
    assert next(m for m in kept.marks if m.kind == "stop").words == "stopped: a person said so"
    assert [m.words for m in kept.marks if m.tick == 20] == ["add obstacle ball"]


def test_a_recording_replays_exactly_from_the_first_tick_and_from_the_middle(tmp_path):
    engine = new_engine()
    first, middle = tmp_path / "first.mcap", tmp_path / "middle.mcap"
    start_recording(engine, SETUP, first, threaded=False, views=False)
    for _ in range(50):
        engine.step()
    start_recording(engine, SETUP, middle, threaded=False, views=False)
    for _ in range(60):
        engine.step()
    engine.close()
    for path, begins, ticks in ((first, 0, 110), (middle, 51, 59)):
        with open_recording(path) as recording:
            assert (recording.head.first_tick, len(recording)) == (begins, ticks)
            assert recording.inputs(0).tick == begins and recording.torn == ""
            assert same_outputs(recording, engine.brain.sibling("qp")) == []


def test_the_plain_reader_finds_an_index_and_every_tick(whole, tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(whole)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count > 8
        counts = summary.statistics.channel_message_counts
        topics = {number: c.topic for number, c in summary.channels.items()}
        assert topics == TOPICS and counts[INPUTS] == counts[WITNESS] == 500
        ticks = [m.sequence for _, _, m in reader.iter_messages(topics=["flinch/inputs"])]
        assert ticks == list(range(500))


# --- what is not as it should be -------------------------------------------------------------


def test_a_torn_file_plays_as_far_as_it_goes(whole, tmp_path):
    path = tmp_path / "run.mcap"
    rng = np.random.default_rng(0)
    places = [*rng.integers(0, len(whole), 60), *range(len(whole) - 60, len(whole)), 0, 1, 8, 9]
    read = []
    for place in sorted(places):
        path.write_bytes(whole[:place])
        try:
            recording = open_recording(path)
        except RecordingError as e:
            assert "cut off before" in str(e) or "no recording" in str(e)
            assert not read and "\n" not in str(e)
            continue
        with recording:
            assert recording.torn.startswith("cut off: it ends after ")
            read.append(len(recording))
            for i in range(0, len(recording), 60):
                assert recording.inputs(i).tick == i
                assert recording.witness(i).mode in Mode
            assert len(recording.times) == len(recording) and len(recording.marks) >= 0
    assert read == sorted(read) and read[-1] == 500 and len(set(read)) > 6


def chunks(content):
    """The pieces of a file, each with the place where it ends."""
    file = BytesIO(content)
    records = StreamReader(file, emit_chunks=True).records
    return [(file.tell(), record) for record in records if isinstance(record, Chunk)]


def test_of_a_file_that_is_cut_off_at_most_the_last_piece_is_lost(whole, tmp_path):
    path = tmp_path / "run.mcap"
    before = 0
    for end, chunk in chunks(whole)[1:]:  # the first piece is the head
        messages = [r for r in breakup_chunk(chunk) if isinstance(r, Message)]
        ticks = before + sum(m.channel_id == INPUTS for m in messages)
        for cut, left in ((end, ticks), (end - 1, before)):
            path.write_bytes(whole[:cut])
            with open_recording(path) as recording:
                assert len(recording) == left
        times = [m.log_time for m in messages]
        assert max(times) - min(times) <= 0.51e9
        before = ticks
    assert before == 500


def test_a_flipped_bit_is_found_where_it_is_and_the_rest_is_read(whole, tmp_path):
    path = tmp_path / "run.mcap"
    rng = np.random.default_rng(1)
    found = 0
    for place in rng.integers(0, len(whole), 150):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            with open_recording(path) as recording:
                for i in range(0, len(recording), 50):
                    recording.inputs(i)
                    recording.bodies(i)
                    recording.witness(i)
                found += bool(recording.torn)
        except RecordingError as e:
            assert "\n" not in str(e) and str(path) in str(e)
            found += 1
    assert found > 100


@pytest.mark.parametrize(
    "content", [b"", b"\x89MCAP0\r\n", b"# Flinch", os.urandom(1000), b"\x89MCAP0\r\n" + b"\1" * 99]
)
def test_a_file_that_is_no_recording_is_refused_in_one_line(content, tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="no recording") as e:
        open_recording(path)
    assert str(e.value).startswith(str(path)) and "\n" not in str(e.value)


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    for path, says in ((tmp_path / "none.mcap", "cannot be read"), (tmp_path, "is a folder")):
        with pytest.raises(RecordingError, match=says):
            open_recording(path)


def other_file(path, profile="flinch", **about):
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile, "other")
        if about:
            writer.add_metadata("flinch.run", about)
        writer.finish()


def test_somebody_elses_file_and_another_version_are_refused_by_name(tmp_path):
    path = tmp_path / "run.mcap"
    other_file(path, "ros2")
    with pytest.raises(RecordingError, match="no recording"):
        open_recording(path)
    other_file(path, format=str(FORMAT + 1), flinch="9.0", kinds="{}", outputs="")
    with pytest.raises(RecordingError, match=r"format 2 by Flinch 9.0; this one reads format 1"):
        open_recording(path)
    other_file(path)
    with pytest.raises(RecordingError, match="format unknown by Flinch unknown"):
        open_recording(path)
    for kinds in ("{", "[]", '{"Goal": 1}', "7"):
        other_file(path, format=str(FORMAT), flinch="0.1", kinds=kinds, outputs="")
        with pytest.raises(RecordingError, match="damaged: it does not tell its fields"):
            open_recording(path)


def test_a_recording_with_a_setting_of_before_is_refused_or_migrated(whole, tmp_path):
    path = tmp_path / "run.mcap"
    name, other = b'"distance_kept"', b'"d_s"          '
    path.write_bytes(whole.replace(name, other))
    with open_recording(path) as recording:
        assert recording.head.params.distance_kept == 0.25
    path.write_bytes(whole.replace(name, b'"k_g"          '))
    with pytest.raises(RecordingError, match=r"has Params.k_g, .* a constant of the method now"):
        open_recording(path)


def test_a_bomb_is_not_unpacked(whole, tmp_path):
    path = tmp_path / "run.mcap"
    end, chunk = chunks(whole)[2]
    size = end - len(chunk.data) - 8 - 8 - 4 - 8  # its place: before crc, name and length
    damaged = bytearray(whole)
    assert struct.unpack_from("<Q", whole, size)[0] == chunk.uncompressed_size
    struct.pack_into("<Q", damaged, size, 1 << 40)
    path.write_bytes(damaged)
    with open_recording(path) as recording, pytest.raises(RecordingError, match="a piece of 1099"):
        recording.inputs(30)


# --- what happens to a recorder ---------------------------------------------------------------


def test_a_file_that_cannot_be_written_is_told_before_anything_moves(tmp_path):
    engine = Handing()
    (tmp_path / "there.mcap").write_text("mine")
    for name, words in (
        ("there.mcap", "exists already; give another name"),
        ("no/where.mcap", "cannot be written"),
        ("there.mcap/x.mcap", "cannot be written"),
    ):
        with pytest.raises(RecordingError, match=words):
            start_recording(engine, SETUP, tmp_path / name)
    assert (tmp_path / "there.mcap").read_text() == "mine" and not engine._followers


class FullDisk:
    """os.write, until there is no room left."""

    def __init__(self, monkeypatch, room):
        self._write, self.room = os.write, room
        monkeypatch.setattr("app.record.run_file.os.write", self)

    def __call__(self, file, data):
        if len(data) > self.room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.room -= len(data)
        return self._write(file, data)


def test_a_full_disk_is_told_at_once_where_it_is_full_already(tmp_path, monkeypatch):
    FullDisk(monkeypatch, 10)
    with pytest.raises(RecordingError, match="No space left on device"):
        start_recording(Handing(), SETUP, tmp_path / "run.mcap")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("spare", [0, 1000])
def test_a_disk_that_fills_up_ends_the_recording_by_name_and_the_run_goes_on(
    tmp_path, monkeypatch, spare
):
    path, engine = tmp_path / "run.mcap", Handing()
    disk = FullDisk(monkeypatch, 10_000_000)
    recorder = start_recording(engine, SETUP, path, threaded=False, views=False)
    engine.hand(300)
    disk.room = spare
    engine.hand(300)
    assert "No space left on device" in recorder.state.fault
    (remark,) = engine.said
    assert remark.refused and str(path) in remark.words
    ticks = recorder.state.ticks
    engine.hand(100)
    recorder.close()
    assert recorder.state.ticks == ticks
    with open_recording(path) as recording:
        assert 200 < len(recording) <= 300 and recording.inputs(199).tick == 199
        assert ("No space" in recording.torn) == (spare > 0) and recording.torn


def test_the_kernels_own_limit_of_a_file_ends_a_recording_that_stays_readable(tmp_path):
    path = tmp_path / "run.mcap"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    engine = Handing()
    recorder = start_recording(engine, SETUP, path, threaded=False, views=False)
    resource.setrlimit(resource.RLIMIT_FSIZE, (250_000, before[1]))
    try:
        engine.hand(600)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert "File too large" in recorder.state.fault
    recorder.close()
    with open_recording(path) as recording:
        assert len(recording) > 60 and recording.inputs(60).tick == 60
        assert recording.torn == "the recording ended by itself: File too large"
    with path.open("rb") as file:  # valid to everyone
        assert sum(
            c.topic == "flinch/inputs" for _, c, _ in make_reader(file).iter_messages()
        ) == len(recording)
    with path.open("rb") as file:
        ends = [r for r in StreamReader(file).records if isinstance(r, Metadata)]
    assert ends[-1].metadata["why"] == "File too large"


def test_what_cannot_be_written_down_ends_the_recording_by_name(tmp_path):
    engine = Handing()
    recorder = start_recording(engine, SETUP, tmp_path / "run.mcap", threaded=False, views=False)
    x, out = run()[1][0]
    recorder.put((replace(x, actions=(object(),)), out))
    recorder.close()
    assert "a object cannot be recorded" in recorder.state.fault


class Stuck(Recorder):
    """Does not write until it may."""

    def __init__(self, *args, **named):
        self.may = threading.Event()
        super().__init__(*args, **named)

    def _write(self, item):
        self.may.wait()
        super()._write(item)


def test_ticks_that_find_no_room_are_counted_and_said(tmp_path):
    path, engine = tmp_path / "run.mcap", Handing()
    recorder = Stuck(path, head_of(SETUP, engine), engine, views=False)
    engine.follow(recorder)
    engine.hand(ROOM + 40)
    dropped = recorder.state.dropped
    assert 39 <= dropped <= 40  # one may have been taken already
    assert [r.refused for r in engine.said] == [True] and "lacks ticks" in engine.said[0].words
    recorder.may.set()
    recorder._worker.drain()
    engine.hand(10)
    recorder.close()
    with open_recording(path) as recording:
        assert recording.dropped == dropped == recorder.state.dropped
        assert len(recording) == ROOM + 50 - dropped and recording.torn == ""
        assert recording.inputs(len(recording) - 10).tick == ROOM + 40


def test_nothing_is_lost_in_a_thread_of_its_own(tmp_path):
    path, engine = tmp_path / "run.mcap", Handing()
    recorder = start_recording(engine, SETUP, path, views=False)
    for _ in range(10):
        engine.hand(60)
        recorder._worker.drain()
    assert stop_recording(engine, recorder).dropped == 0
    with open_recording(path) as recording:
        assert len(recording) == 600


def test_a_recording_of_no_tick_at_all_can_be_opened(tmp_path):
    path = tmp_path / "run.mcap"
    assert recorded(path, 0).ticks == 0
    with open_recording(path) as recording:
        assert len(recording) == 0 and recording.torn == "" and len(recording.times) == 0
        with pytest.raises(IndexError):
            recording.inputs(0)


def test_a_format_is_what_the_file_says_of_its_kinds(whole, tmp_path):
    (tmp_path / "run.mcap").write_bytes(whole)
    with (tmp_path / "run.mcap").open("rb") as file:
        (about, _) = [r for r in StreamReader(file).records if isinstance(r, Metadata)]
    assert "distance_kept" in json.loads(about.metadata["kinds"])["Params"]


RECORD = """
import sys
from pathlib import Path
from app.record.recorder import start_recording
from tests.recorded import SETUP, Handing

engine = Handing()
recorder = start_recording(engine, SETUP, Path(sys.argv[1]), views=False)
while True:
    engine.hand(25)
    recorder._worker.drain()
    print(engine.tick, flush=True)
"""


def killed(path, after):
    """Ticks that a process had handed on when it was killed by SIGKILL, `after` ticks or more."""
    child = subprocess.Popen([sys.executable, "-c", RECORD, str(path)], stdout=subprocess.PIPE)
    try:
        for line in child.stdout:
            if int(line) >= after:
                break
        child.send_signal(signal.SIGKILL)
        rest = child.stdout.read().split()
    finally:
        child.kill()
        child.wait()
        child.stdout.close()
    return int(rest[-1]) if rest else int(line)


def survives(path, after):
    handed = killed(path, after)
    with open_recording(path) as recording:
        assert recording.torn.startswith("cut off") and recording.dropped == 0
        assert handed - len(recording) <= SETUP.rate  # a second
        assert [recording.inputs(i).tick for i in range(len(recording))] == [*range(len(recording))]


def test_of_a_process_that_is_killed_all_but_the_last_second_is_readable(tmp_path):
    survives(tmp_path / "run.mcap", 330)


@pytest.mark.slow
def test_of_a_process_that_is_killed_at_twenty_moments_all_but_the_last_second_is_readable(
    tmp_path,
):
    for n, after in enumerate(np.random.default_rng(2).integers(130, 2000, 20)):
        survives(tmp_path / f"{n}.mcap", after)


@pytest.mark.slow
def test_an_hour_is_recorded_in_bounded_memory(tmp_path):
    engine = Handing()
    ring = Ring(engine, SETUP, threaded=False)
    engine.follow(ring)
    recorder = start_recording(engine, SETUP, tmp_path / "run.mcap", threaded=False)
    used = []
    for _ in range(30):  # minutes at 125 Hz
        engine.hand(round(60 * SETUP.rate))
        gc.collect()
        used.append(int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize())
    stop_recording(engine, recorder)
    growth = (used[-1] - used[4]) / 25 * 60 * 2  # [bytes] an hour at 250 Hz: its index
    assert growth < 64e6


def test_a_new_file_holds_its_format_before_the_first_tick(tmp_path):
    RunFile(tmp_path / "run.mcap")
    with pytest.raises(RecordingError, match="was cut off before its first tick"):
        open_recording(tmp_path / "run.mcap")
