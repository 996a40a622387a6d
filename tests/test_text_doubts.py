"""What cannot be right in a text stream: it is refused by name, and no wrong frame is given."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import SensorError
from app.sensing.port_spec import PortSpec, parse_ports
from app.sensing.serial_skin import SerialSkin
from app.sensing.stream import Stream as PortStream
from app.sensing.wire import lines, zone_lines
from app.sensing.wire.described import Print
from app.sensing.wire.detect import FORMATS, Detector, format_of
from app.sensing.wire.reader import TextReader
from tests.ports import HandPort, raw
from tests.test_text_matrix import STREAMS, decoder_of, is_right
from tests.text_streams import BESIDE, ROWS, codes, joined, rows, truth

SAMPLE = STREAMS[::7] + [s for s in STREAMS if "grid" in s[1].name or "table" in s[1].name]
MESSAGES = (
    b"ets Jul 29 2019 12:21:46\r\n", b"rst:0x1 (POWERON_RESET),boot:0x13\r\n", b"\r\n",
    b"W (4567) wifi: retry\n", b"12 13\n", b"?\xff\xfe\n", b"\x1b[0m\n", b"temp 31\n",
)  # fmt: skip


@given(st.sampled_from(SAMPLE), st.data())
def test_messages_and_lost_lines_cost_frames_and_make_no_wrong_one(case, data):
    side, stream = case
    pieces = stream.data.splitlines(keepends=True)
    for _ in range(data.draw(st.integers(0, 3))):
        at = data.draw(st.integers(0, len(pieces)))
        pieces.insert(at, data.draw(st.sampled_from(MESSAGES)))
    if data.draw(st.booleans()):
        del pieces[data.draw(st.integers(0, len(pieces) - 1))]
    for frame in decoder_of(stream.how, side).feed(b"".join(pieces)):
        assert any(is_right(frame, right) for right in stream.right)


@given(st.sampled_from(STREAMS), st.sampled_from(STREAMS), st.integers(0, 2000))
def test_after_another_print_the_reader_still_gives_none_but_right_frames(one, other, cut):
    side, stream = one
    decoder = decoder_of(stream.how, side)
    before = decoder.feed(other[1].data[cut:] + b"\r\n\r\n")
    got = decoder.feed(stream.data)
    assert len(before) <= 12
    for frame in got:
        assert any(is_right(frame, right) for right in stream.right) or frame.grid != (side, side)


def stream_of(side, second, head=("", "")):
    out = []
    for number in range(8):
        for name, grid in zip(head, (truth(side, number), second(number)), strict=True):
            out += [name, *(" ".join(map(str, row)) for row in grid.tolist()), ""]
    return joined(["boot", "", *out])


@pytest.mark.parametrize(
    ("second", "head", "says"),
    [
        (lambda n: codes(8, n), ("Distance", "Status"), "two grids"),
        (lambda n: codes(8, n), ("", ""), "two grids"),
        (lambda n: truth(8, n) + 800, ("", ""), "two grids"),
        (lambda n: truth(8, n), ("Left", "Right"), "several headings, 'Right' and 'Left'"),
        (lambda n: truth(8, n), ("Sensor 1", "Sensor 2"), "several headings"),
    ],
)
def test_two_grids_taken_for_distances_stop_with_their_name(second, head, says):
    reader = TextReader(ROWS)
    got = reader.feed(stream_of(8, second, head))
    assert says in reader.trouble and "PORT#FILE.toml" in reader.trouble
    assert len(got) <= 8 and reader.feed(stream_of(8, second, head)) == []


def test_another_quantitys_grid_is_left_out():
    reader = TextReader(ROWS)
    got = reader.feed(stream_of(8, lambda n: codes(8, n) * 3, ("Distance [mm]", "Sigma")))
    assert len(got) == 8 and reader.trouble == ""
    assert all(is_right(f, (truth(8, n).ravel(), np.full(64, 5))) for n, f in enumerate(got))


def test_statuses_of_zero_are_refused_with_the_name_that_trusts_them():
    both = FORMATS["st-cube"].encode(raw(distance=700))
    for name in ("", "table"):
        detector = Detector(name)
        assert detector.feed(b"\n" + both * 3) == []
        assert "#st-cube" in detector.trouble and "valid = [0]" in detector.trouble
    trusting = Detector("st-cube")
    assert [set(f.status) for f in trusting.feed(b"\n" + both)] == [{5}]
    assert trusting.feed(FORMATS["table"].encode(raw(distance=700))) == []
    assert "has status 5" in trusting.trouble


def test_statuses_that_never_count_as_valid_are_named_after_a_second():
    reader = zone_lines.ZoneLines(zone_lines.ULD)
    sent = zone_lines.encode(raw(status=np.where(np.arange(64) % 3, 4, 13)))
    got = [len(reader.feed(b"\n" + sent)) for _ in range(20)]
    assert got == [1] * 15 + [0] * 5 and "(they are 4, 13)" in reader.trouble


@pytest.mark.parametrize(
    ("how", "show", "says"),
    [
        (ROWS, lambda v: f"{v} cm", "it prints cm"),
        (ROWS, lambda v: f"{v / 1000:.3f}", "no millimetres"),
        (ROWS, lambda v: f"{v}:5", "statuses stand beside"),
        (BESIDE, str, "no statuses stand beside"),
        (Print(unit=10.0), lambda v: f"{v} mm", "it prints mm"),
    ],
)
def test_a_unit_or_a_status_that_the_description_denies_is_refused(how, show, says):
    reader = TextReader(how)
    for _, printed in rows(ROWS, 8, show):
        assert reader.feed(joined(["", *printed, ""])) == []
    assert says in reader.trouble


def test_json_is_no_sparkfun_example():
    detector = Detector("lines")
    assert detector.feed(b"\n" + FORMATS["json"].encode(raw())) == []
    assert "#json" in detector.trouble


@pytest.mark.parametrize("name", ["lines", "adafruit", "esphome", "json", "pairs-plain"])
def test_what_nobody_named_is_described_with_the_names_there_are(name):
    detector = Detector()
    assert detector.feed(b"\n" + FORMATS[name].encode(raw()) * 4) == [] and not detector.name
    assert f"#{name.replace('lines', 'lines-plain')}" in detector.trouble


# --- rates --------------------------------------------------------------------------------


def test_a_rate_that_no_sensor_has_stops_the_stream_and_a_right_one_does_not():
    sent = lines.encode(raw(distance=700))
    for hz, stops in ((15, False), (20, False), (30, True)):
        stream = PortStream("lines")
        for i in range(10 * hz):
            stream.feed(sent if i else b"\n" + sent, i / hz)
        assert ("a second, and its sensor can measure 15" in stream.trouble) == stops
        assert stream.rate > 0.0


def test_a_slow_sketch_is_told_which_setting_to_raise(robot, skin):
    port = HandPort(format_name="lines")
    source = SerialSkin(skin, [port], [PortSpec(port.name, sensors=(4,))])
    posture, connected = robot.posture(robot.home), np.arange(skin.count) == 4
    for i in range(100):
        if i % 10 == 0:
            port.hear(b"\n" * (i == 0) + lines.encode(raw(distance=700 + i)), 0.1 * i)
        source.poll(0.1 * i, posture)
    says = source.fault(9.9, 0.5, connected)
    assert "is silent" in says and "1.0 frames a second" in says and "ranging frequency" in says
    assert "ranging frequency" in dict(source.inputs(9.9))[port.name]


def test_a_port_in_doubt_is_unclear_and_gives_nothing(robot, skin):
    port = HandPort(format_name="lines")
    source = SerialSkin(skin, [port], [PortSpec(port.name, sensors=(4,))])
    posture, connected = robot.posture(robot.home), np.arange(skin.count) == 4
    source.poll(0.0, posture)
    port.hear(stream_of(8, lambda n: codes(8, n), ("Distance", "Status")), 0.1)
    source.poll(0.1, posture)
    says = source.fault(0.1, 0.5, connected)
    assert says.startswith("port /dev/hand is unclear: it prints two grids")
    assert dict(source.inputs(0.1))["/dev/hand"].startswith("unclear")


# --- files --------------------------------------------------------------------------------

MINE = """lines = "columns"
columns = "from right"
rows = "from bottom"
unit = "cm"
status = "none"
skip = 1

[sensors]
"Left" = "ring1-02"
"Right" = "ring2-05"
"""


def test_a_file_describes_a_print_of_several_sensors(tmp_path, robot, skin):
    path = tmp_path / "my sketch.toml"
    path.write_text(MINE)
    (spec,) = parse_ports(f"/dev/hand#{path}", skin)
    assert spec.sensors == spec.meant == (1, 14) and spec.format == str(path)
    port = HandPort("/dev/hand", str(path))
    source = SerialSkin(skin, [port], [spec])
    posture = robot.posture(robot.home)
    source.poll(0.0, posture)
    how = Print(columns=True, from_right=True, from_bottom=True)
    out = []
    for number, printed in rows(how, 8, lambda v: f"{v / 10:.1f}", " "):
        name = "Left" if number % 2 else "Right"
        out += [f"{name}:", *(f"{i} {row}" for i, row in enumerate(printed))]
    port.hear(joined(["boot", *out]), 0.05)
    got = source.poll(0.05, posture)
    assert [f.sensor for f in got] == [14, 1, 14, 1]
    for number, frame in enumerate(got):
        assert np.allclose(frame.distance, truth(8, number).ravel() / 1000, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (MINE.replace('unit = "cm"', ""), "unit"),
        (MINE.replace('"cm"', '"ft"'), "unit"),
        (MINE.replace("skip = 1", "valid = []"), "valid is empty"),
        (MINE.replace('"Left"', '"Righ"'), "tell the sensors apart"),
        (MINE.replace("ring2-05", "ring9-05"), "no sensor or ring 'ring9-05'"),
        (MINE + "speed = 3\n", "speed"),
    ],
)
def test_a_file_that_leaves_something_open_is_refused_in_one_line(tmp_path, skin, text, says):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(SensorError) as error:
        parse_ports(f"/dev/hand#{path}", skin)
    assert says in str(error.value) and "\n" not in str(error.value)


def test_a_format_that_is_no_name_and_no_file_says_that_files_are_possible(tmp_path):
    with pytest.raises(SensorError, match=r"or a file FILE\.toml"):
        format_of("mine")
    with pytest.raises(SensorError, match="cannot be read"):
        format_of(str(tmp_path / "none.toml"))
    assert FORMATS["uld"].status and not FORMATS["lines"].status
