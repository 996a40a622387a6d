"""Recorded frames: parsed by rows, played with their own gaps, refused with the line."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import SensorError
from app.robot.skin_file import load_skin
from app.sensing.replay import Replay, read_recording
from app.sensing.replays import open_replay, recorded


def block(t_ms, distance=500, targets=1, status=5, zones=64):
    return [f"{t_ms},0,0"] + [f"{distance + z},{targets},{status}" for z in range(zones)]


def write(tmp_path, lines, name="state_ToF.csv"):
    file = tmp_path / name
    file.write_text("\n".join(lines) + "\n")
    return file


def test_frames_keep_their_times_gaps_and_statuses(tmp_path, skin, robot):
    lines = block(1000) + block(1067, status=9) + block(1067) + block(1400, targets=0, status=255)
    write(tmp_path, lines)
    replay = Replay(read_recording(tmp_path), skin, 3)  # the folder will do
    posture = robot.posture(robot.home)
    assert [f.sequence for f in replay.poll(10.0, posture)] == [0]
    later = replay.poll(10.07, posture)
    assert [f.stamp for f in later] == pytest.approx([10.067, 10.067])
    assert replay.poll(10.39, posture) == [] and not replay.ended()
    (last,) = replay.poll(10.41, posture)
    assert (last.status == 255).all() and (last.targets == 0).all() and last.sensor == 3
    assert last.distance[2] == pytest.approx(0.502)
    assert "has ended" in replay.ended()
    assert replay.connected.sum() == 1 and replay.connected[3]


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (block(0) + block(67)[:-5], r"torn after line 125, 60 lines into .* cut it after line 65"),
        (block(0)[1:] + block(67), r"line 1 should start a frame"),
        (block(0) + block(67)[:-1] + block(133) + block(200), r"line 131 should start"),
        (["time,x,y"], r"line 1 is not three whole numbers"),
        (["1,2"], r"line 1 is not three whole numbers"),
        ([], r"is empty"),
        (block(100) + block(50), r"line 66: time goes back"),
        ([*block(0)[:-1], "500,1,300"], r"line 65 is no 'distance_mm.* \(500,1,300\)"),
    ],
)  # fmt: skip
def test_a_torn_or_foreign_file_is_refused_with_its_line(tmp_path, lines, says):
    with pytest.raises(SensorError, match=says) as error:
        read_recording(write(tmp_path, lines))
    assert "\n" not in str(error.value)


def test_a_file_that_is_missing_or_binary_is_refused(tmp_path):
    with pytest.raises(SensorError, match="cannot be read"):
        read_recording(tmp_path / "none.csv")
    (tmp_path / "b.csv").write_bytes(bytes(range(256)))
    with pytest.raises(SensorError, match="is binary, not UTF-8 text"):
        read_recording(tmp_path / "b.csv")


@settings(max_examples=60)
@given(st.lists(st.text(alphabet="0123456789,- abc", max_size=12), max_size=140))
def test_no_text_raises_anything_but_a_sensor_error(tmp_path_factory, lines):
    file = tmp_path_factory.mktemp("fuzz") / "x.csv"
    file.write_text("\n".join(lines))
    try:
        recording = read_recording(file)
    except SensorError as error:
        assert "\n" not in str(error)
    else:
        assert recording.distance.shape == (len(recording.stamp), 64)


def test_frames_of_8x8_are_refused_on_a_4x4_sensor(tmp_path, robot):
    sparse = load_skin(robot.folder / "skin/sparse-4x4.toml", robot)
    recording = read_recording(write(tmp_path, block(0)))
    with pytest.raises(SensorError, match="4x4 sensor ring-01"):
        Replay(recording, sparse, 0)


def test_recorded_distances_become_metres(tmp_path):
    recording = read_recording(write(tmp_path, block(5, distance=1000)))
    assert recording.distance[0, 0] == pytest.approx(1.0)
    assert recording.stamp.tolist() == [0.0]
    assert isinstance(recording.distance, np.ndarray) and not recording.distance.flags.writeable


@pytest.fixture
def sparse(robot):
    """A ring of 4x4 sensors."""
    return load_skin(robot.folder / "skin/sparse-4x4.toml", robot)


@pytest.mark.parametrize("frames", [1, 2, 6, 65])
def test_frames_of_4x4_are_told_by_where_they_begin(tmp_path, robot, sparse, skin, frames):
    lines = [line for i in range(frames) for line in block(100 * i, zones=16)]
    recording = read_recording(write(tmp_path, lines))
    assert recording.grid == (4, 4) and recording.distance.shape == (frames, 16)
    replay = Replay(recording, sparse, 2)
    (first, *_) = replay.poll(5.0, robot.posture(robot.home))
    assert first.sensor == 2 and first.distance.shape == (16,)
    with pytest.raises(SensorError, match="4x4 frames cannot play on the 8x8 sensor ring1-01"):
        Replay(recording, skin, 0)


def test_frames_of_8x8_in_which_nothing_is_seen_stay_8x8(tmp_path):
    lines = [line for i in range(17) for line in block(i, 0, 0, 0)]
    lines = [line.split(",")[0] + ",0,0" if i % 65 else line for i, line in enumerate(lines)]
    assert read_recording(write(tmp_path, lines)).grid == (8, 8)


def test_a_torn_file_of_4x4_is_cut_at_its_own_frames(tmp_path):
    lines = [line for i in range(6) for line in block(i, zones=16)][:-3]
    with pytest.raises(SensorError, match="torn after line 99, 14 lines into a frame of 17"):
        read_recording(write(tmp_path, lines))


def several(tmp_path, **begins):
    """A folder of folders with sensors' names, each with two frames 100 ms apart."""
    for name, begin in begins.items():
        folder = tmp_path / "all" / name.replace("_", "-")
        folder.mkdir(parents=True)
        write(folder, block(begin) + block(begin + 100))
    return tmp_path / "all"


def test_a_folder_of_sensors_plays_all_of_them_on_its_one_clock(tmp_path, robot, skin):
    source = open_replay(str(several(tmp_path, ring1_02=5000, ring3_10=5040)), skin)
    posture = robot.posture(robot.home)
    assert np.flatnonzero(source.connected).tolist() == [1, 29]
    assert [(f.sensor, f.stamp) for f in source.poll(20.0, posture)] == [(1, 20.0)]
    later = source.poll(20.2, posture)
    assert [f.sensor for f in later] == [29, 1, 29]
    assert [f.stamp for f in later] == pytest.approx([20.04, 20.1, 20.14])
    assert source.ended() == "the replay of 2 sensors has ended"


def test_recordings_between_commas_begin_at_once(tmp_path, robot, skin):
    for name, begin in (("a", 5000), ("b", 9000)):
        (tmp_path / name).mkdir()
        write(tmp_path / name, block(begin))
    text = f"{tmp_path}/a@ring1-03, {tmp_path}/b@ring2-01"
    frames = open_replay(text, skin).poll(1.0, robot.posture(robot.home))
    assert [(f.sensor, f.stamp) for f in frames] == [(2, 1.0), (10, 1.0)]
    with pytest.raises(SensorError, match="ring1-01 is given twice"):
        open_replay(f"{tmp_path}/a,{tmp_path}/b", skin)


def test_a_folder_that_bears_no_sensors_name_is_named(tmp_path, skin):
    with pytest.raises(SensorError, match=r"'ring1-1' has no sensor's name; did you mean"):
        open_replay(str(several(tmp_path, ring1_02=0, ring1_1=0)), skin)
    (tmp_path / "empty").mkdir()
    with pytest.raises(SensorError, match=r"state_ToF.csv: cannot be read"):
        open_replay(str(tmp_path / "empty"), skin)


def test_a_recording_of_other_zones_is_refused_by_checks_too(tmp_path, robot, skin):
    write(tmp_path, block(0, zones=16))
    with pytest.raises(SensorError, match="4x4 frames cannot play"):
        recorded(f"{tmp_path}@ring1-02", skin, robot.posture(robot.home))
