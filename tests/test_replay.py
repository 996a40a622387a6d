"""Recorded frames: parsed by rows, played with their own gaps, refused with the line."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import SensorError
from app.sensing.replay import Replay, read_recording


def block(t_ms, distance=500, targets=1, status=5):
    return [f"{t_ms},0,0"] + [f"{distance + z},{targets},{status}" for z in range(64)]


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
    with pytest.raises(SensorError, match="is not text"):
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
    from app.robot.skin_file import load_skin

    sparse = load_skin(robot.folder / "skin/sparse-4x4.toml", robot)
    recording = read_recording(write(tmp_path, block(0)))
    with pytest.raises(SensorError, match="4x4 sensor ring-01"):
        Replay(recording, sparse, 0)


def test_recorded_distances_become_metres(tmp_path):
    recording = read_recording(write(tmp_path, block(5, distance=1000)))
    assert recording.distance[0, 0] == pytest.approx(1.0)
    assert recording.stamp.tolist() == [0.0]
    assert isinstance(recording.distance, np.ndarray) and not recording.distance.flags.writeable
