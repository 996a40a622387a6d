"""The virtual skin: what it says is what a skin would say, faults included."""

import json
import subprocess
import sys
import time

import numpy as np
import pytest

from app.cli import main
from app.errors import SensorError
from app.robot.skin_file import load_skin
from app.sensing.port_spec import named_sensors
from app.sensing.replay import read_recording
from app.sensing.wire.detect import FORMATS
from app.setup import Setup
from app.timing import ManualClock, WallClock
from app.virtual.skin.emulate import (
    Emulation,
    RecordedFrames,
    Transmitter,
    emulate,
    raw_frame,
    send_frames,
)
from app.virtual.skin.faults import Faults, FaultyWire, mirrored, parse_faults


class Spool:
    """Keeps what is written to the port."""

    def __init__(self):
        self.packets, self.lost = [], 0

    def write(self, packet):
        self.packets.append(packet)


class Chorus:
    """A frame of each of `sensors` at every call, each zone a little different."""

    def __init__(self, sensors=(3, 4)):
        self.sensors, self.count = sensors, 0

    def poll(self, now):
        from tests.fakes import frame

        self.count += 1
        at = (1000 + np.arange(64) + self.count) * 1e-3
        return [frame(k, now, at, sequence=self.count) for k in self.sensors]


def heard(skin, faults, seconds=10.0, sensors=(3, 4), seed=0):
    """Frames that a decoder makes of what a faulty board says at 15 Hz, and the decoder."""
    clock, spool = ManualClock(), Spool()
    wire = FaultyWire(faults, clock.now(), seed)
    encode = FORMATS["binary"].encode
    send_frames(Chorus(sensors), skin, Transmitter(encode, wire, spool), clock, 1 / 15, seconds)
    decoder = FORMATS["binary"].decoder()
    return decoder.feed(b"".join(spool.packets)), decoder


def test_without_faults_every_frame_is_said_as_it_is(skin):
    frames, decoder = heard(skin, Faults())
    assert len(frames) >= 2 * 149 and not decoder.refused
    assert {f.sensor for f in frames} == {3, 4} and frames[0].distance[5] == 1006
    assert frames[30].t_us == pytest.approx(15 / 15 * 1e6, abs=2)


def test_flipped_bits_and_cut_packets_are_refused_by_the_decoder(skin):
    whole, decoder = heard(skin, Faults(bits=1e-4), 60.0)
    share = len(whole) / 1800
    assert share == pytest.approx(np.exp(-1680e-4), abs=0.03)  # 1680 bits a packet
    assert decoder.refused.total() > 100
    whole, decoder = heard(skin, Faults(truncate=0.2), 60.0)
    assert 0.5 < len(whole) / 1800 < 0.85  # a cut delimiter costs the next packet, too


def test_silence_begins_and_ends_when_it_should(skin):
    frames, _ = heard(skin, Faults(silence=(2.0, 3.0)), 8.0, sensors=(3,))
    times = np.array([f.t_us for f in frames]) * 1e-6
    gaps = np.diff(times)
    assert gaps.max() == pytest.approx(3.0, abs=0.1) and times[gaps.argmax()] < 2.01
    assert not heard(skin, Faults(silence=(0.0, np.inf)), 3.0)[0]


def test_reordered_packets_all_come_but_late(skin):
    frames, _ = heard(skin, Faults(reorder=0.3), sensors=(3,))
    sequence = [f.sequence for f in frames]
    assert sequence != sorted(sequence)
    assert sorted(sequence)[:-1] == list(range(1, len(sequence)))


def test_a_drifting_and_wrapping_clock_does_both(skin):
    frames, _ = heard(skin, Faults(drift=100.0, wrap=5.0), 10.0, sensors=(3,))
    clock = np.array([f.t_us for f in frames], dtype=np.int64)
    assert clock[0] == 2**32 - 5_000_000 and clock[-1] < 2**31
    ran = (clock[-1] - clock[0]) % 2**32
    assert ran == pytest.approx(frames_span(frames) * (1e6 + 100), abs=5)


def frames_span(frames):
    """Seconds from the first to the last of frames at 15 Hz."""
    return (len(frames) - 1) / 15


def test_frozen_sensors_swapped_columns_and_swapped_ids(skin):
    frames, _ = heard(skin, Faults(frozen=(3,)))
    assert len({f.distance.tobytes() for f in frames if f.sensor == 3}) == 1
    assert len({f.distance.tobytes() for f in frames if f.sensor == 4}) > 100
    good, _ = heard(skin, Faults())
    turned, _ = heard(skin, Faults(columns=(4,)))
    for a, b in zip(good, turned, strict=True):
        expected = mirrored(a).distance if a.sensor == 4 else a.distance
        assert np.array_equal(b.distance, expected)
    swapped, _ = heard(skin, Faults(ids=(3, 4)))
    assert [f.sensor for f in swapped[:4]] == [4, 3, 4, 3]


def test_faults_are_parsed_from_words(skin):
    def sensors(name):
        return named_sensors(name, skin)

    faults = parse_faults("bits=1e-4,silence=5:2,frozen=ring1-02,ids=ring1-01:ring2-01", sensors)
    assert faults == Faults(bits=1e-4, silence=(5.0, 2.0), frozen=(1,), ids=(0, 10))
    assert parse_faults("silence=5", sensors).silence == (5.0, np.inf)
    for text, says in (
        ("bit=1", "did you mean 'bits'"),
        ("bits=2", "give a number from 0 to 1"),
        ("bits=many", "could not convert"),
        ("ids=ring1", "names 10 sensors; give two"),
        ("frozen=ring9", "no sensor or ring"),
    ):
        with pytest.raises(SensorError, match=says) as error:
            parse_faults(text, sensors)
        assert "\n" not in str(error.value)


def test_a_recording_is_said_by_every_sensor_again_and_again(skin, robot, tmp_path):
    lines = []
    for t in (0, 67, 133):
        lines += [f"{t},0,0"] + [f"{500 + t + z},1,5" for z in range(63)] + ["947,0,255"]
    (tmp_path / "state_ToF.csv").write_text("\n".join(lines) + "\n")
    recording = read_recording(tmp_path)
    source = RecordedFrames(recording, skin, (2, 7), robot.posture(robot.home))
    seen = [f for i in range(200) for f in source.poll(i * 0.005)]
    for k in (2, 7):
        own = [raw_frame(f, (8, 8), 0) for f in seen if f.sensor == k]
        assert [f.sequence for f in own] == list(range(len(own))) and len(own) > 9
        assert [int(f.distance[0]) for f in own[:4]] == [500, 567, 633, 500]
        assert own[0].status[63] == 255


def test_a_4x4_sensor_says_16_zones(robot):
    sparse = load_skin(robot.folder / "skin/sparse-4x4.toml", robot)
    small, _ = heard(sparse, Faults(), 1.0, sensors=(0,))
    assert small[0].grid == (4, 4) and len(small[0].status) == 16


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_the_emulator_and_the_reader_understand_each_other(tmp_path, name, skin):
    """The scene at full rate through a real pseudo terminal, in every format."""
    import threading

    from app.sensing.open_ports import open_skin

    link, over = tmp_path / "skin", threading.Event()
    there = threading.Event()
    what = Emulation(link, name, only="ring2-03")
    board = threading.Thread(
        target=emulate,
        args=(what, Setup(scene="cell"), WallClock(), lambda _: there.set(), over.is_set),
    )
    board.start()
    try:
        assert there.wait(30.0)
        source = open_skin(f"{link}#{name}=ring2-03", skin, WallClock())
        frames, end = [], time.perf_counter() + 10.0
        while len(frames) < 5 and time.perf_counter() < end:
            frames += source.poll(time.perf_counter(), None)
            time.sleep(0.004)
        source.close()
    finally:
        over.set()
        board.join()
    assert len(frames) >= 5 and {f.sensor for f in frames} == {12}
    assert (np.diff([f.stamp for f in frames]) >= 0.0).all()


def test_the_command_says_where_it_is_and_ends_when_asked(tmp_path):
    link = tmp_path / "skin"
    process = subprocess.Popen(
        [sys.executable, "-m", "app", "skin", "emulate", "--link", str(link), "--only", "ring1"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        first = process.stdout.readline()
        assert "ring1-01 to ring1-10 at 15 Hz, format binary" in first and link.is_symlink()
    finally:
        process.terminate()
        rest = process.communicate(timeout=30)[0]
    assert process.returncode == 0 and "frames" in rest and not link.is_symlink()


def test_a_headless_run_on_a_virtual_skin_sees_what_it_says(tmp_path, capsys):
    link = tmp_path / "skin"
    process = subprocess.Popen(
        [sys.executable, "-m", "app", "skin", "emulate", "--link", str(link), "--seconds", "60"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout.readline()
        common = ("run", "--headless", "--seconds", "1.5", "--sensors", f"serial:{link}", "--json")
        assert main(common) == 0
    finally:
        process.terminate()
        process.communicate(timeout=30)
    row = json.loads(capsys.readouterr().out)["rows"][0]
    assert row["sensors"] == f"serial:{link}" and 1.4 < row["seconds"] < 5.0


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("--format", "binary", "--only", "ring9"), "no sensor or ring 'ring9'"),
        (("--replay", "/none"), "cannot be read"),
        (("--faults", "fire=1"), "no fault 'fire'"),
        (("--seconds", "-1"), "give a positive number"),
    ],
)
def test_bad_words_are_one_line(capsys, tmp_path, args, says):
    assert main(["skin", "emulate", "--link", str(tmp_path / "x"), *args]) == 1
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and says in err
