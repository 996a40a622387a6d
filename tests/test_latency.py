"""How old a frame is when it comes: given, estimated from its size, or told by a clock."""

import os
import pty
import time
import tty

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.choices import build_robot_and_skin
from app.sensing.latency import ESTIMATED, TOLD, latency, latency_words, with_stamp_doubt
from app.sensing.open_ports import open_skin
from app.sensing.port_spec import PortSpec, parse_ports
from app.sensing.serial_skin import SerialSkin
from app.sensing.wire import binary, f_line, lines
from app.sensing.wire.detect import FORMATS
from app.setup import Setup
from app.timing import WallClock
from tests.ports import HandPort, raw

FORMAT = st.sampled_from(["", *FORMATS])


@given(
    name=st.from_regex(r"/dev/tty[A-Z]{3}\d", fullmatch=True) | st.just("socket://localhost:7000"),
    baud=st.none() | st.integers(9600, 12_000_000),
    form=FORMAT,
    sensors=st.sampled_from(["", "ring2-03", "ring1"]),
    ms=st.none() | st.floats(0.0, 150.0),
)
def test_every_specification_is_read_as_it_was_written(skin, name, baud, form, sensors, ms):
    text = name + (f"@{baud}" if baud else "") + (f"#{form}" if form else "")
    text += (f"={sensors}" if sensors else "") + ("" if ms is None else f":latency_ms={ms!r}")
    (spec,) = parse_ports(text, skin)
    assert (spec.port, spec.baud, spec.format) == (name, baud or 0, form)
    assert len(spec.sensors) == {"": 0, "ring2-03": 1, "ring1": 10}[sensors]
    assert spec.latency == (None if ms is None else pytest.approx(ms * 1e-3))


@given(size=st.floats(0.0, 5000.0), more=st.floats(0.0, 5000.0), baud=st.integers(9600, 2_000_000))
def test_more_bytes_and_a_slower_line_are_never_less_late(skin, size, more, baud):
    kind, spec = skin.sensors[0].type, PortSpec("/dev/ttyUSB0")
    late = latency(spec, kind, False, size, baud)
    assert kind.integration / 2 <= late <= latency(spec, kind, False, size + more, baud)
    assert late <= latency(spec, kind, False, size, 9600)
    assert latency(PortSpec("/dev/ttyUSB0", latency=0.04), kind, False, size, baud) == 0.04


def test_usual_number_lines_at_115200_baud_are_40_ms_late(skin):
    kind, size = skin.sensors[0].type, len(lines.encode(raw(distance=1000)))
    late = latency(PortSpec("/dev/ttyUSB0"), kind, False, size, 115_200)
    assert late == pytest.approx(0.010 + 10 * size / 115_200) and 0.035 < late < 0.045
    # a board with USB of its own has no line to wait for
    assert latency(PortSpec("/dev/ttyACM0"), kind, False, size, 115_200) == 0.010


@pytest.mark.parametrize("name", ["lines", "table"])
def test_the_size_of_a_frame_is_counted_on_the_line_and_not_guessed(name):
    port, sent = HandPort(format_name=name), FORMATS[name].encode(raw(distance=1234))
    stuff = b"joined in the middle\n" * 40 + sent * 12
    for start in range(0, len(stuff), 97):
        port.hear(stuff[start : start + 97], 0.0)
    sizes = [a.size for a in port.receive()]
    assert sizes[-1] == pytest.approx(len(sent), rel=0.05)


@pytest.mark.parametrize("encode", [binary.encode, f_line.encode])
def test_a_constant_latency_is_taken_off_the_stamps_of_a_boards_clock_too(robot, skin, encode):
    posture = robot.posture(robot.home)
    for given_ms, late in ((None, 0.0), (0.025, 0.025)):
        port = HandPort()
        source = SerialSkin(skin, [port], [PortSpec(port.name, latency=given_ms)])
        port.hear(b"\n" + encode(raw(3, 0, 0)), 1.0)
        port.hear(encode(raw(3, 1, 66_000)), 1.066)
        stamps = [f.stamp for f in source.poll(1.066, posture)]
        assert stamps[-1] == pytest.approx(1.066 - late)
        words = dict(source.inputs(1.066))[port.name]
        assert ("latency 25 ms as given" in words) == (given_ms is not None)


def test_what_a_port_can_be_says_how_sure_its_stamps_are(skin):
    known = skin.doubt.time
    text = "/dev/a=ring1-01,/dev/b#lines=ring1-02,/dev/c#f=ring1-03,/dev/d=ring2"
    time = with_stamp_doubt(skin, parse_ports(text, skin)).doubt.time
    assert time[:2] == pytest.approx(ESTIMATED) and (time[2:] == known[2:]).all()
    given = parse_ports("/dev/a#lines=ring1-01:latency_ms=30", skin)
    told = with_stamp_doubt(skin, given).doubt.time
    assert known[0] < told[0] == TOLD < ESTIMATED and (told[1:] == known[1:]).all()
    setup = Setup(sensors="serial:/dev/a#lines=ring1-01+simulated")
    assert build_robot_and_skin(setup)[1].doubt.time[0] == ESTIMATED


def test_what_the_calibration_of_the_mounts_found_is_told_beside_it():
    spec = PortSpec("/dev/a")
    assert latency_words(spec, 0.0, 0.0) == ""
    assert latency_words(spec, 0.0, 0.012) == "latency +12 ms by the mounts' calibration"
    assert latency_words(spec, 0.039, -0.002).startswith("latency about 39 ms, and -2 ms by the")
    assert "as given" in latency_words(PortSpec("/dev/a", latency=0.0), 0.0, 0.0)


def test_frames_of_a_terminal_are_stamped_before_they_arrive_and_the_page_says_by_how_much(
    robot, skin
):
    master, slave = pty.openpty()
    tty.setraw(slave)
    name = os.ttyname(slave)
    source = open_skin(f"{name}@115200#lines=ring2-06", skin, WallClock())
    try:
        frames, clock, posture = [], WallClock(), robot.posture(robot.home)
        sent = lines.encode(raw(distance=900))
        os.write(master, b"\n")
        end = time.perf_counter() + 5.0
        while len(frames) < 3:
            assert time.perf_counter() < end, "waited in vain"
            os.write(master, sent)
            time.sleep(0.002)
            frames += source.poll(clock.now(), posture)
        late = clock.now() - frames[-1].stamp
        assert late > 0.010 + 10 * len(sent) / 115_200 - 1e-3
        words = dict(source.inputs(clock.now()))[name]
        assert "latency about 3" in words and "give latency_ms" in words
    finally:
        source.close()
        os.close(slave)
        os.close(master)
