"""Wire formats: byte-exact examples, any chunking, any garbage, never a wrong binary frame."""

import zlib
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from app.errors import SensorError
from app.sensing.wire import binary, f_line, lines, table
from app.sensing.wire.detect import FORMATS, Detector, format_of
from app.sensing.wire.raw import RawFrame

RISING = [100 + 10 * z for z in range(64)]  # zone by zone, in the driver's order
VALID = np.full(64, 5, dtype=np.uint8)


def raw(distance=RISING, status=VALID, sensor=3, sequence=7, t_us=1234567, grid=(8, 8)):
    return RawFrame(
        sensor, sequence, t_us, grid,
        np.array(distance, dtype=np.int16), np.array(status, dtype=np.uint8), 30,
    )  # fmt: skip


def small():
    """A 4x4 frame."""
    return raw(RISING[:16], VALID[:16], grid=(4, 4))


def same(a, b):
    return np.array_equal(a.distance, b.distance) and np.array_equal(a.status, b.status)


@st.composite
def frames(draw, grids=((4, 4), (8, 8))):
    grid = draw(st.sampled_from(grids))
    rng, n = np.random.default_rng(draw(st.integers(0, 2**32))), grid[0] * grid[1]
    distance = rng.integers(-32768, 32768, n).astype(np.int16)
    status = rng.choice(np.array([5, 9, 4, 255], dtype=np.uint8), n)
    return raw(
        distance, status, draw(st.integers(0, 255)), draw(st.integers(0, 2**16 - 1)),
        draw(st.integers(0, 2**32 - 1)), grid,
    )  # fmt: skip


def cut(stream, cuts):
    """The stream in pieces that end at the `cuts`, shares of its length."""
    edges = [0, *sorted(round(c * len(stream)) for c in cuts), len(stream)]
    return [stream[a:b] for a, b in pairwise(edges)]


# --- byte-exact examples ------------------------------------------------------------------

ROW = "\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\r\n"
PRINTED = [[100 + 10 * (8 * r + 7 - c) for c in range(8)] for r in range(8)]  # mirrored
SPARKFUN = (
    "SparkFun VL53L5CX Imager Example\r\n"
    "Initializing sensor board. This can take up to 10s. Please wait.\r\n"
    + "".join(ROW.format(*row) for row in PRINTED)
    + "\r\n"
).encode()
COMMAS = ("ready\n" + "".join(", ".join(map(str, row)) + "\n" for row in PRINTED) + "\n").encode()
ONE_LINE = ("boot\r\nDATA:" + ",".join(str(d) for row in PRINTED for d in row) + "\r\n").encode()
FOUR = b"4x4 mode\n" + b"".join(
    "\t".join(str(100 + 10 * (4 * r + 3 - c)) for c in range(4)).encode() + b"\n" for r in range(4)
)


def cell(distance, status):
    return f"| \x1b[38;5;10m{distance:5d}\x1b[0m  :  {status:5d} "


def st_table(rows, signal=False):
    """The maker's table, printed by hand: rows of (distance, status) or None."""
    text = (
        "\x1b[2H53L8A1 Simple Ranging demo application\n"
        "--------------------------------------\n\n"
        "Use the following keys to control application\n"
        " 'r' : change resolution\n 's' : enable signal and ambient\n 'c' : clear screen\n\n"
        "Cell Format :\n\n"
        " \x1b[38;5;10m       Distance [mm]\x1b[0m :               Status\n\n\n"
    )
    n = len(rows)
    for row in rows:
        text += " -----------------" * n + "\n" + "|                 " * n + "|\n"
        text += "".join("|     X  :      X " if c is None else cell(*c) for c in row) + "|\n"
        if signal:
            text += "".join(f"| {1234:5d}  :  {56:5d} " for _ in row) + "|\n"
    return (text + " -----------------" * n + "\n").encode()


@pytest.mark.parametrize("stream", [SPARKFUN, COMMAS, ONE_LINE], ids=["tabs", "commas", "DATA"])
@pytest.mark.parametrize("size", [1, 2, 7, 64, 10_000])
def test_number_lines_are_read_mirrored_and_not_at_any_chunking(stream, size):
    for name, turned in (("lines", False), ("lines-plain", True)):
        decoder = FORMATS[name].decoder()
        got = [f for i in range(0, len(stream), size) for f in decoder.feed(stream[i : i + size])]
        assert len(got) == 1 and got[0].sensor is None and got[0].grid == (8, 8)
        expected = np.array(PRINTED).ravel() if turned else RISING
        assert got[0].distance.tolist() == list(expected)
        assert (got[0].status == 5).all()


def test_number_lines_of_4x4_fill_the_first_sixteen_zones():
    (frame,) = FORMATS["lines"].decoder().feed(FOUR + b"\n")
    assert frame.grid == (4, 4) and frame.distance.tolist() == RISING[:16]
    assert (frame.status[16:] == 255).all()


def test_without_a_status_only_distances_between_0_and_4_m_are_valid():
    values = [0, -5, 1, 3999, 4000, *[500] * 59]
    stream = b"\n" + ",".join(map(str, values)).encode() + b"\n"
    (frame,) = FORMATS["lines-plain"].decoder().feed(stream)
    assert frame.status[:6].tolist() == [255, 255, 5, 5, 255, 5]


@pytest.mark.parametrize("damage", ["row lost", "number lost", "letter", "row twice", "too large"])
def test_a_damaged_block_of_number_lines_is_dropped_and_the_next_one_read(damage):
    rows = [ROW.format(*row).encode() for row in PRINTED]
    bad = list(rows)
    bad[4] = {
        "row lost": b"",
        "number lost": rows[4].replace(b"\t480", b""),
        "letter": rows[4].replace(b"480", b"4x0"),
        "row twice": rows[4] * 2,
        "too large": rows[4].replace(b"480", b"40000"),
    }[damage]
    assert bad[4] != rows[4]
    decoder = FORMATS["lines"].decoder()
    assert decoder.feed(b"\r\n" + b"".join(bad) + b"\r\n") == []
    assert decoder.refused
    (frame,) = decoder.feed(b"".join(rows) + b"\r\n")
    assert frame.distance.tolist() == RISING


@pytest.mark.parametrize("signal", [False, True])
@pytest.mark.parametrize("size", [1, 3, 17, 10_000])
def test_the_makers_table_is_read_mirrored_and_not_at_any_chunking(signal, size):
    rows = [[(d, 9 if d == 480 else 5) for d in row] for row in PRINTED]
    rows[0][7] = None  # printed last, so mirrored it is zone 0
    stream = st_table(rows, signal) * 2
    for name, turned in (("table", False), ("table-plain", True)):
        decoder = FORMATS[name].decoder()
        got = [f for i in range(0, len(stream), size) for f in decoder.feed(stream[i : i + size])]
        assert len(got) == 2 and not decoder.refused
        expected = np.array(PRINTED).ravel() if turned else np.array(RISING)
        empty = 7 if turned else 0
        for frame in got:
            seen = np.arange(64) != empty
            assert np.array_equal(frame.distance[seen], expected[seen])
            assert frame.status[empty] == 255
            assert (frame.status[expected == 480] == 9).all()


def test_the_table_of_4x4_is_read():
    rows = [[(100 + 10 * (4 * r + 3 - c), 5) for c in range(4)] for r in range(4)]
    (frame,) = FORMATS["table"].decoder().feed(st_table(rows))
    assert frame.grid == (4, 4) and frame.distance.tolist() == RISING[:16]


def test_a_table_with_a_lost_row_or_cell_is_dropped_and_the_next_one_read():
    stream = st_table([[(d, 5) for d in row] for row in PRINTED])
    row = cell(480, 5).encode()
    for bad in (stream.replace(row, b""), stream.replace(row, row[:-9]), stream[1500:]):
        decoder = FORMATS["table"].decoder()
        (frame,) = decoder.feed(b"\n" + bad + stream)
        assert frame.distance.tolist() == RISING


F_LINE = "F,3,1234567,7," + ",".join(map(str, RISING)) + ",5" * 64 + "\n"


@pytest.mark.parametrize("size", [1, 11, 10_000])
def test_the_f_line_is_read_at_any_chunking(size):
    stream = b"joined in the midd\n" + F_LINE.encode()
    decoder = f_line.FLines()
    (frame,) = (f for i in range(0, len(stream), size) for f in decoder.feed(stream[i : i + size]))
    assert (frame.sensor, frame.t_us, frame.sequence) == (3, 1234567, 7)
    assert same(frame, raw())


@pytest.mark.parametrize(
    "bad",
    [F_LINE.replace("F,3", "F,300"), F_LINE.replace(",110,", ",1x0,"), F_LINE.replace(",5\n", "\n"),
     F_LINE.replace(",5\n", ",256\n"), F_LINE.replace("1234567", "-1"), "F,1\n", "F,\n"],
)  # fmt: skip
def test_a_damaged_f_line_is_refused(bad):
    decoder = f_line.FLines()
    assert decoder.feed(b"\n" + bad.encode()) == [] and decoder.refused.total() == 1


def test_the_binary_frame_is_byte_for_byte_as_the_protocol_says():
    payload = bytes.fromhex("1103 08 0700 87d61200 1e 40 00".replace(" ", ""))
    payload += b"".join(d.to_bytes(2, "little") for d in RISING) + b"\x05" * 64
    assert len(payload) == 204
    packet = cobs.encode(payload + zlib.crc32(payload).to_bytes(4, "little")) + b"\0"
    assert len(packet) == 210 and binary.encode(raw()) == packet
    (frame,) = binary.Binary().feed(packet)
    assert (frame.sensor, frame.grid, frame.sequence) == (3, (8, 8), 7)
    assert (frame.t_us, frame.temperature) == (1234567, 30)
    assert same(frame, raw())


def test_the_second_version_is_byte_for_byte_as_the_protocol_says():
    distance, status = [500, 600, 0xFFFF - 65536], [0, 255, 7]
    payload = bytes.fromhex("21 05 03 01 0700 87d61200 e2 0200 00")
    payload += b"".join(d.to_bytes(2, "little", signed=True) for d in distance) + bytes(status)
    assert len(payload) == 14 + 3 * 3
    packet = cobs.encode(payload + zlib.crc32(payload).to_bytes(4, "little")) + b"\0"
    sent = replace(raw(distance, status, 5, grid=(3, 1)), temperature=-30)
    assert binary.encode(sent) == packet
    (frame,) = binary.Binary().feed(packet)
    assert (frame.sensor, frame.grid, frame.sequence) == (5, (3, 1), 7)
    assert (frame.t_us, frame.temperature) == (1234567, -30) and same(frame, sent)


@pytest.mark.parametrize(
    ("at", "value", "why"),
    [(2, 2, "resolution"), (3, 0, "resolution"), (2, 33, "resolution"), (11, 3, "targets"),
     (0, 0x31, "length")],
)  # fmt: skip
def test_a_second_version_with_a_wrong_field_is_refused(at, value, why):
    whole = binary.encode(raw([500, 600, 700], [5, 255, 5], grid=(3, 1)))
    payload = bytearray(cobs.decode(whole[:-1])[:-4])
    payload[at] = value
    packet = cobs.encode(bytes(payload) + zlib.crc32(payload).to_bytes(4, "little")) + b"\0"
    decoder = binary.Binary()
    assert decoder.feed(packet) == [] and decoder.refused == {why: 1}


@pytest.mark.parametrize(
    ("at", "value", "why"),
    [(0, 0x12, "kind"), (0, 0x21, "resolution"), (2, 5, "resolution"), (10, 63, "targets")],
)
def test_a_payload_with_a_right_checksum_and_a_wrong_field_is_refused(at, value, why):
    payload = bytearray(cobs.decode(binary.encode(raw())[:-1])[:204])
    payload[at] = value
    packet = cobs.encode(bytes(payload) + zlib.crc32(payload).to_bytes(4, "little")) + b"\0"
    decoder = binary.Binary()
    assert decoder.feed(packet) == [] and decoder.refused == {why: 1}


# --- properties ---------------------------------------------------------------------------

shares = st.lists(st.floats(0, 1), max_size=8)


ANY = ((4, 4), (8, 8), (16, 16), (1, 1), (3, 20), (32, 32))


@given(st.lists(frames(ANY), min_size=1, max_size=5), shares)
def test_binary_frames_survive_any_chunking(sent, cuts):
    stream = b"".join(map(binary.encode, sent))
    decoder = binary.Binary()
    got = [f for chunk in cut(stream, cuts) for f in decoder.feed(chunk)]
    assert len(got) == len(sent) and not decoder.refused
    for a, b in zip(sent, got, strict=True):
        assert same(a, b) and a.grid == b.grid
        assert (a.sensor, a.sequence, a.t_us) == (b.sensor, b.sequence, b.t_us)


@given(frames(), shares)
def test_the_f_line_carries_all_but_the_temperature(sent, cuts):
    stream = b"\n" + f_line.encode(sent)
    decoder = f_line.FLines()
    (got,) = (f for chunk in cut(stream, cuts) for f in decoder.feed(chunk))
    assert same(sent, got) and (sent.sensor, sent.t_us) == (got.sensor, got.t_us)
    assert got.grid == sent.grid


@given(frames(), st.booleans(), shares)
def test_what_the_table_prints_is_read_back(sent, mirrored, cuts):
    decoder = FORMATS["table" if mirrored else "table-plain"].decoder()
    stream = table.encode(sent, mirrored)
    (got,) = (f for chunk in cut(stream, cuts) for f in decoder.feed(chunk))
    seen = sent.status != 255
    assert np.array_equal(got.status, sent.status)
    # a cell has room for five characters; what is longer still has its colon
    assert np.array_equal(got.distance[seen], sent.distance[seen])


def on_one_line(frame: RawFrame, mirrored: bool) -> bytes:
    """All zones on one line, after `DATA:`, as some boards print them."""
    shown = lines.encode(frame, mirrored).split()
    return b"DATA:" + b",".join(shown) + b"\r\n"


@given(frames(), st.booleans(), st.booleans(), shares)
def test_what_number_lines_print_is_read_back(sent, mirrored, one_line, cuts):
    sent = replace(sent, distance=np.clip(sent.distance, -4000, 3999).astype(np.int16))
    encode = on_one_line if one_line else lines.encode
    decoder = FORMATS["lines" if mirrored else "lines-plain"].decoder()
    stream = b"\n" + encode(sent, mirrored)
    (got,) = (f for chunk in cut(stream, cuts) for f in decoder.feed(chunk))
    valid = (sent.status != 255) & (sent.distance > 0)
    assert np.array_equal(got.status == 5, valid)
    assert np.array_equal(got.distance[valid], sent.distance[valid])


garbage = st.one_of(
    st.binary(max_size=600),
    st.text(alphabet="0123456789,\t\r\n -|:XFDATA\x1b[", max_size=600).map(str.encode),
    st.lists(frames(), max_size=2).map(lambda fs: b"".join(map(binary.encode, fs))[3:-5]),
)


@given(st.lists(garbage, max_size=4), frames())
def test_after_any_garbage_the_next_whole_frame_of_every_format_is_read(junk, sent):
    sent = replace(sent, distance=np.clip(sent.distance, 1, 3999).astype(np.int16))
    for name, style in FORMATS.items():
        decoder = style.decoder()
        for chunk in junk:
            decoder.feed(chunk)
        # a delimiter, or a line end, shows where a frame begins
        decoder.feed(b"\0" if name == "binary" else b"\n\n\n")
        end = b"" if name == "binary" else b"\n"
        got = decoder.feed(style.encode(sent) + end)
        assert len(got) == 1, name
        assert np.array_equal(
            got[0].distance[sent.status != 255], sent.distance[sent.status != 255]
        )


@given(st.lists(garbage, max_size=6))
def test_no_garbage_becomes_a_binary_frame(junk):
    decoder, stream = binary.Binary(), b"".join(junk)
    for frame in decoder.feed(stream):  # a whole frame may hide in the garbage: then it is there
        assert binary.encode(frame)[:-1] in stream


@given(frames(), st.lists(st.integers(0, 209 * 8), min_size=1, max_size=12))
def test_no_flipped_bits_make_a_wrong_binary_frame(sent, flips):
    packet = bytearray(binary.encode(sent))
    for bit in flips:
        packet[bit // 8] ^= 1 << (bit % 8)
    for frame in binary.Binary().feed(bytes(packet)):
        assert same(frame, sent) and frame.sensor == sent.sensor


@given(st.binary(min_size=1, max_size=3000), st.integers(1, 40))
def test_what_a_decoder_keeps_is_bounded(chunk, repeats):
    for style in FORMATS.values():
        decoder = style.decoder()
        for _ in range(repeats):
            decoder.feed(chunk)
        assert held(decoder) < 5000, style
        assert len(decoder.refused) < 10


def held(decoder):
    """Bytes, characters and numbers that a decoder keeps."""
    kept = getattr(decoder, "_rest", b"") + getattr(getattr(decoder, "_lines", None), "_rest", b"")
    block = getattr(decoder, "_block", [])
    rows = block.rows + block.codes if hasattr(block, "rows") else block
    return len(kept) + sum(map(len, rows))


# --- which format speaks ------------------------------------------------------------------


@pytest.mark.parametrize("name", ["binary", "f", "table", "uld"])
@pytest.mark.parametrize("begin", [0, 1, 100])
def test_the_format_is_found_from_the_middle_of_a_stream(name, begin):
    stream = format_of(name).encode(raw()) * 3
    detector = Detector()
    got = [f for i in range(begin, len(stream), 50) for f in detector.feed(stream[i : i + 50])]
    assert detector.name == name and len(got) >= 1 and same(got[-1], raw())


@given(st.binary(max_size=2000))
def test_garbage_has_no_format(junk):
    detector = Detector()
    assert detector.feed(junk) == [] and detector.name == "" and not detector.refused


def test_an_unknown_format_is_named_with_the_known_ones():
    with pytest.raises(
        SensorError, match=r"no format 'binry' of serial skins; did you mean 'binary'\? known: "
    ):
        format_of("binry")


def test_a_small_frame_has_its_own_zones_alone_in_every_format():
    for name, style in FORMATS.items():
        decoder = style.decoder()
        (got,) = decoder.feed(b"\n" * (name != "binary") + style.encode(small()))
        assert got.grid == (4, 4) and same(got, small()), name
