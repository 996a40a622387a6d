"""Raw bytes of a skin in a file: the same reads at the same times give the same frames again."""

import errno
import os
import time

import numpy as np
import pytest
from mcap.reader import make_reader

from app.checks.skin_check import simulate, skin_check
from app.checks.skin_record import entries, record_skin
from app.choices import choose_skin
from app.errors import SensorError
from app.robot.skin_file import load_skin
from app.sensing.capture import PROFILE, CaptureWriter
from app.sensing.captured import is_capture, read_capture
from app.sensing.latency import ESTIMATED
from app.sensing.open_ports import open_skin
from app.sensing.replays import open_replay, play_through, recorded
from app.sensing.stream import Stream
from app.sensing.wire import binary, f_line, lines, table
from app.setup import Setup
from app.timing import ManualClock, WallClock
from app.virtual.skin.emulate import Emulation, emulate
from app.virtual.skin.pty_port import PtyPort
from app.wiring import build_engine
from tests.ports import raw, restless

PATIENCE = 5.0  # [s] for what should come at once
BOARD = "/dev/board"


def write(path, reads, text=BOARD, clock=None):
    """A file of these reads: port's name, stream, bytes, time [s]."""
    writer = CaptureWriter(path, text.split(","), clock or ManualClock())
    for read in reads:
        writer.put(*read)
    writer.close()
    return path


def said(frames, port=BOARD, baud=2_000_000, encode=binary.encode, period=0.07, begin=0.0):
    """Reads of a port, one frame in each."""
    stream = Stream(baud=baud)
    return [(port, stream, encode(f), begin + i * period) for i, f in enumerate(frames)]


def replayed(path, robot, skin, sensor=""):
    text = f"{path}@{sensor}" if sensor else str(path)
    return list(play_through(open_replay(text, skin), robot.posture(robot.home)))


def same(a, b):
    """The same frame, up to when the clock was started and the nanosecond that a file keeps."""
    return (
        (a.sensor, a.sequence) == (b.sensor, b.sequence)
        and np.array_equal(a.distance, b.distance)
        and np.array_equal(a.status, b.status)
        and np.array_equal(a.targets, b.targets)
    )


@pytest.mark.parametrize("style", ["binary", "f", "table", "lines"])
def test_bytes_that_came_in_odd_cuts_over_a_port_give_the_same_frames_again(
    style, tmp_path, robot, skin
):
    encode = {"binary": binary, "f": f_line, "table": table, "lines": lines}[style].encode
    rng, posture = np.random.default_rng(1), robot.posture(robot.home)
    one = style in ("table", "lines")
    stream = b"".join(
        encode(raw(3 if one else i % 30, i // 30, 2000 * i, 300 + i)) for i in range(60)
    )
    live = []
    with PtyPort(tmp_path / "skin") as board:
        text = f"{board.link}#{style}" + ("=ring1-04" if one else "")
        source = open_skin(text, skin, WallClock())
        writer = CaptureWriter(tmp_path / "a.mcap", entries(text, source.ports), WallClock())
        source.overhear(writer.put)
        end, clock = time.perf_counter() + PATIENCE, WallClock()
        total, sent = len(stream), 0
        while writer.bytes < total:
            assert time.perf_counter() < end, "waited in vain"
            n = int(rng.integers(1, 900))
            if board.heard:
                board.write(stream[sent : sent + n])
                sent += n
            live += source.poll(clock.now(), posture)
        writer.close()
        source.close()
    again = replayed(tmp_path / "a.mcap", robot, skin)
    assert len(again) == len(live) >= 59  # a line's last row ends with the next frame's first
    assert all(map(same, again, live))
    apart = [a.stamp - b.stamp for a, b in zip(again, live, strict=True)]
    assert apart == pytest.approx([apart[0]] * len(apart), abs=1e-6)


def test_a_plain_reader_finds_ports_bytes_and_times(tmp_path):
    frames = [restless(3, i, 0) for i in range(5)]
    path = write(tmp_path / "a.mcap", said(frames), f"{BOARD}@115200#binary=ring1")
    with path.open("rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == PROFILE
        (meta,) = [m for m in reader.iter_metadata() if m.name == PROFILE]
        assert meta.metadata == {"version": "1", "ports": f'["{BOARD}@115200#binary=ring1"]'}
        got = list(reader.iter_messages())
    assert [c.topic for _, c, _ in got] == [BOARD] * 5
    assert [m.data for _, _, m in got] == [binary.encode(f) for f in frames]
    times = [m.log_time for _, _, m in got]
    assert np.diff(times).tolist() == [70_000_000] * 4 and times[0] > 1.7e18


def test_a_port_that_was_plugged_again_or_tried_at_another_speed_is_another_stream(
    tmp_path, robot, skin
):
    half = binary.encode(raw(3, 0))[:100]
    noise = Stream(baud=115_200)
    reads = [(BOARD, noise, half, 0.0)]  # what a wrong speed made of it is not decoded on
    reads += said([restless(3, i, 0) for i in range(3)], begin=0.1)
    reads += said([restless(4, i, 0) for i in range(4)], begin=0.5, encode=f_line.encode)
    frames = replayed(write(tmp_path / "a.mcap", reads), robot, skin)
    # a stream's first line may be half of one
    assert [f.sensor for f in frames] == [3, 3, 3, 4, 4, 4]
    source = open_replay(str(tmp_path / "a.mcap"), skin)
    posture = robot.posture(robot.home)
    for now in np.arange(0.0, 1.0, 0.1):
        source.poll(now, posture)
        if now == pytest.approx(0.4):
            assert "binary · 1 sensors" in dict(source.inputs(now))[BOARD]
    assert "f · 2 sensors" in dict(source.inputs(now))[BOARD] and source.ended()


def test_silence_is_played_as_it_was_and_named(tmp_path, robot, skin):
    reads = said([restless(3, i, 0) for i in range(3)])
    reads += said([restless(3, 3, 0)], begin=5.0)
    source = open_replay(str(write(tmp_path / "a.mcap", reads)), skin)
    posture, used = robot.posture(robot.home), np.ones(skin.count, dtype=bool)
    for now in np.arange(100.0, 104.0, 0.05):
        source.poll(now, posture)
    assert "is silent for" in source.fault(104.0, 1.0, used)
    assert not source.ended()
    while now < 105.2:
        now += 0.05
        source.poll(now, posture)
    assert source.ended() == "the replay of a.mcap has ended"
    assert source.connected[3] and source.connected.sum() == 1


def test_a_torn_file_plays_as_far_as_it_goes_and_says_so(tmp_path, robot, skin):
    whole = write(tmp_path / "a.mcap", said([restless(3, i, 0) for i in range(6)])).read_bytes()
    torn, most = tmp_path / "torn.mcap", 0
    for cut in range(0, len(whole), 7):
        torn.write_bytes(whole[:cut])
        try:
            source = open_replay(str(torn), skin)
        except SensorError as e:
            assert "\n" not in str(e) and most == 0
            continue
        frames = list(play_through(source, robot.posture(robot.home)))
        assert len(frames) >= most
        most = len(frames)
        assert "torn" in source.ended()
    assert most == 6


def test_no_damage_of_a_file_is_more_than_a_word(tmp_path, robot, skin):
    whole = write(tmp_path / "a.mcap", said([restless(3, i, 0) for i in range(4)])).read_bytes()
    rng, path = np.random.default_rng(2), tmp_path / "damaged.mcap"
    for _ in range(150):
        bits = np.frombuffer(whole, np.uint8).copy()
        bits[rng.integers(len(bits), size=4)] ^= np.uint8(1 << int(rng.integers(8)))
        path.write_bytes(bits.tobytes())
        try:
            frames = [] if not is_capture(path) else replayed(path, robot, skin)
        except SensorError as e:
            assert "\n" not in str(e)
        else:
            assert len(frames) <= 4


def test_an_engine_runs_on_it_and_ends_with_it(tmp_path, skin):
    each = [(i, k) for i in range(20) for k in range(30)]
    frames = [restless(k, i, round(1e6 * n / 450)) for n, (i, k) in enumerate(each)]
    path = write(tmp_path / "a.mcap", said(frames, period=1 / 450))
    engine = build_engine(Setup(sensors=f"replay:{path}"), ManualClock())
    try:
        modes = [engine.step() for _ in range(400)]
        assert modes[200].rate.min() > 10.0 and np.isfinite(modes[200].cloud.points).any()
        assert modes[-1].status.reason == "the replay of a.mcap has ended"
    finally:
        engine.close()


def test_a_hand_in_a_capture_is_checked_against_the_layout(tmp_path, robot, skin):
    depth = simulate(robot, skin, 15, "hand", 0)
    frames = []
    for i, frame in enumerate(depth):
        seen = np.isfinite(frame)
        mm = np.where(seen, np.nan_to_num(frame) * 1e3, 947).round()
        frames.append(raw(15, i, 70_000 * i, mm, np.where(seen, 5, 255)))
    path = write(tmp_path / "hand.mcap", said(frames))
    report = skin_check(Setup(), "hand", str(path))
    assert report.checks[0].ok and report.rows[0]["name"] == "ring2-06"
    assert not skin_check(Setup(), "hand", f"{_mirrored(path, frames)}@ring2-06").checks[0].ok


def _mirrored(path, frames):
    """The same as bare numbers that are read as plain though they are mirrored."""
    reads = said(frames, encode=lines.encode)
    text = f"{BOARD}#lines-plain=ring2-06"
    return write(path.with_name("mirrored.mcap"), reads, text)


def test_one_of_several_sensors_has_to_be_named(tmp_path, robot, skin):
    frames = [restless(k, i, 0) for i in range(3) for k in (3, 4)]
    path = write(tmp_path / "a.mcap", said(frames))
    posture = robot.posture(robot.home)
    with pytest.raises(SensorError, match=r"name one of its sensors as .*known: ring1-04, ring1-0"):
        recorded(str(path), skin, posture)
    k, distance, status, targets = recorded(f"{path}@ring1-05", skin, posture)
    assert k == 4 and distance.shape == status.shape == targets.shape == (3, 64)
    with pytest.raises(SensorError, match="name one"):
        recorded(f"{path}@ring2-01", skin, posture)


def test_bytes_without_a_name_can_be_given_to_a_sensor_later(tmp_path, robot, skin):
    reads = said([raw(distance=700)] * 4, encode=lines.encode)
    path = write(tmp_path / "a.mcap", reads, f"{BOARD}#lines")
    assert replayed(path, robot, skin) == []  # its format names no sensor
    frames = replayed(path, robot, skin, "ring3-01")
    assert {f.sensor for f in frames} == {20} and frames[0].distance[0] == pytest.approx(0.7)
    text = f"{BOARD},/dev/other"
    both = write(tmp_path / "b.mcap", said([restless(3, 0, 0)]), text)
    with pytest.raises(SensorError, match="holds 2 ports; leave @ring1 out"):
        open_replay(f"{both}@ring1", skin)


def test_stamps_without_a_clock_are_as_unsure_as_live(tmp_path, robot, skin):
    path = write(tmp_path / "a.mcap", said([raw()]), f"{BOARD}#lines=ring1-02")
    time = choose_skin(Setup(sensors=f"replay:{path}"), robot).doubt.time
    assert time[1] == ESTIMATED and (np.delete(time, 1) == np.delete(skin.doubt.time, 1)).all()


def test_recording_a_port_says_what_came(tmp_path, robot, skin):
    told = []
    with PtyPort(tmp_path / "skin") as board:
        sent = iter(range(40))
        end = time.perf_counter() + PATIENCE

        def over():
            assert time.perf_counter() < end, "waited in vain"
            i = next(sent, None)
            if i is not None:
                board.write(binary.encode(restless(i % 30, i // 30, 0)))
            return i is None

        file = tmp_path / "b.mcap"
        size, states = record_skin(
            str(board.link), file, robot, skin, WallClock(), told.append, over
        )
        assert told == [f"recording {board.link} into {file}"]
        assert size > 39 * 200 and "binary · 30 sensors" in dict(states)[str(board.link)]
        assert is_capture(file)
        with pytest.raises(SensorError, match="is there already"):
            record_skin(str(board.link), file, robot, skin, WallClock(), told.append, over)


def test_a_port_that_says_nothing_leaves_no_file(tmp_path, robot, skin):
    with PtyPort(tmp_path / "skin") as board:
        file = tmp_path / "c.mcap"
        with pytest.raises(SensorError, match=r"nothing came, so there is no .*waiting"):
            record_skin(
                str(board.link), file, robot, skin, WallClock(), lambda _: None, lambda: True
            )
        assert not file.exists()


def test_a_full_disk_is_one_line_and_what_was_written_plays(tmp_path, robot, skin, monkeypatch):
    writer = CaptureWriter(tmp_path / "a.mcap", [BOARD], ManualClock())
    reads = said([restless(3, i, 0) for i in range(4)])
    for read in reads[:3]:
        writer.put(*read)
    writer._file.flush()

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(writer._writer, "add_message", full)
    monkeypatch.setattr(writer._writer, "finish", full)
    with pytest.raises(SensorError, match=r"a.mcap: cannot be written \(No space left"):
        writer.put(*reads[3])
    writer.close()
    assert len(replayed(tmp_path / "a.mcap", robot, skin)) == 3


def test_a_file_that_is_killed_while_it_is_written_lacks_half_a_second_at_most(tmp_path):
    writer = CaptureWriter(tmp_path / "a.mcap", [BOARD], ManualClock())
    for read in said([restless(3, i, 0) for i in range(100)]):
        writer.put(*read)
    on_disk = (tmp_path / "a.mcap").read_bytes()  # nobody has closed it
    (tmp_path / "b.mcap").write_bytes(on_disk)
    robot_less = read_capture(tmp_path / "b.mcap")
    assert robot_less.entries == (BOARD,)
    assert on_disk.count(binary.encode(restless(3, 92, 0))) == 1
    writer.close()


def test_a_capture_of_another_version_or_kind_is_refused(tmp_path, skin):
    path = write(tmp_path / "a.mcap", said([restless(3, 0, 0)]))
    other = path.read_bytes().replace(b"version\x01\0\0\x001", b"version\x01\0\0\x009")
    (tmp_path / "b.mcap").write_bytes(other)
    with pytest.raises(SensorError, match="another version"):
        read_capture(tmp_path / "b.mcap")
    run = path.read_bytes().replace(PROFILE.encode(), b"flinch.tick")
    (tmp_path / "c.mcap").write_bytes(run)
    assert not is_capture(tmp_path / "c.mcap")
    with pytest.raises(SensorError, match="play a recorded run by flinch replay"):
        open_replay(str(tmp_path / "c.mcap"), skin)
    with pytest.raises(SensorError, match="is no recording of a skin"):
        read_capture(tmp_path / "c.mcap")


def test_auto_is_recorded_as_what_was_found():
    assert entries("auto#f:latency_ms=5", ("/dev/a", "/dev/b")) == [
        "/dev/a#f:latency_ms=5", "/dev/b#f:latency_ms=5",
    ]  # fmt: skip
    assert entries("/dev/a=ring1, /dev/b", ("/dev/a", "/dev/b")) == ["/dev/a=ring1", "/dev/b"]


def test_a_capture_of_another_layout_names_the_sensor_that_is_missing(tmp_path, robot):
    path = write(tmp_path / "a.mcap", said([raw()]), f"{BOARD}=ring2-06")
    sparse = load_skin(robot.folder / "skin/sparse-4x4.toml", robot)
    with pytest.raises(SensorError, match="no sensor or ring 'ring2-06'"):
        open_replay(str(path), sparse)


def test_a_virtual_port_says_captured_bytes_again(tmp_path, robot, skin):
    frames = [restless(i % 30, i // 30, 1000 * i) for i in range(60)]
    path = write(tmp_path / "a.mcap", said(frames, period=1e-3))
    what, again = Emulation(tmp_path / "skin", replay=str(path)), []
    posture, clock = robot.posture(robot.home), WallClock()
    end = time.perf_counter() + PATIENCE
    listeners = []

    def over():
        assert time.perf_counter() < end, "waited in vain"
        if not listeners:
            listeners.append(open_skin(str(what.link), skin, clock))
        again.extend(listeners[0].poll(clock.now(), posture))
        return len(again) == 60

    try:
        emulate(what, Setup(), clock, lambda _: None, over)
        while not over():
            pass
    finally:
        listeners[0].close()
    assert all(map(same, again, replayed(path, robot, skin)))


def test_recorded_bytes_take_no_faults_and_are_of_one_port(tmp_path, skin):
    path = write(tmp_path / "a.mcap", said([raw()]))
    with pytest.raises(SensorError, match="leave --faults and --only out"):
        Emulation(tmp_path / "skin", replay=str(path), faults="bits=1e-4")
    both = write(tmp_path / "b.mcap", said([raw()]), f"{BOARD},/dev/other")
    with pytest.raises(SensorError, match="holds several ports"):
        emulate(Emulation(tmp_path / "skin", replay=str(both)), Setup(), WallClock(), print)
