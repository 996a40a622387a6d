"""RTDE packets: what is packed is read again, at any chunking, and garbage is refused in words."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.robot.ur.wire import (
    FORMATS,
    LONGEST,
    Kind,
    Packet,
    WireError,
    names,
    output_setup,
    pack,
    pack_values,
    split,
    unpack_values,
)

packets = st.builds(Packet, st.integers(0, 255), st.binary(max_size=200))
VALUES = {
    "BOOL": st.booleans(),
    "UINT8": st.integers(0, 255),
    "UINT32": st.integers(0, 2**32 - 1),
    "UINT64": st.integers(0, 2**64 - 1),
    "INT32": st.integers(-(2**31), 2**31 - 1),
    "DOUBLE": st.floats(allow_nan=False),
    "VECTOR3D": st.tuples(*[st.floats(allow_nan=False)] * 3),
    "VECTOR6D": st.tuples(*[st.floats(allow_nan=False)] * 6),
    "VECTOR6INT32": st.tuples(*[st.integers(-(2**31), 2**31 - 1)] * 6),
    "VECTOR6UINT32": st.tuples(*[st.integers(0, 2**32 - 1)] * 6),
}


def test_a_packet_has_the_bytes_of_the_makers_guide():
    assert pack(Kind.VERSION, b"\x00\x02") == b"\x00\x05V\x00\x02"
    assert pack(Kind.START) == b"\x00\x03S"


@given(st.lists(packets, max_size=8), st.lists(st.integers(1, 50), max_size=60))
def test_packets_are_read_again_at_any_chunking(sent, cuts):
    stream = b"".join(pack(*p) for p in sent)
    read, rest, at = [], b"", 0
    for cut in [*cuts, len(stream) + 1]:
        more, rest = split(rest + stream[at : at + cut])
        read += more
        at += cut
    assert (read, rest) == (sent, b"")


@given(st.binary(max_size=600))
def test_garbage_is_a_wire_error_or_waits_for_more(garbage):
    try:
        read, rest = split(garbage)
    except WireError as refused:
        assert "\n" not in str(refused)
    else:
        assert b"".join(pack(*p) for p in read) + rest == garbage and len(rest) < LONGEST


@given(st.lists(st.sampled_from(sorted(FORMATS)), max_size=12), st.data())
def test_values_are_read_again(types, data):
    values = [data.draw(VALUES[t]) for t in types]
    assert unpack_values(types, pack_values(types, values)) == values


@given(st.lists(st.sampled_from(sorted(FORMATS)), min_size=1, max_size=12), st.binary(max_size=80))
def test_a_data_packet_of_another_length_is_refused(types, payload):
    size = struct.calcsize(">" + "".join(FORMATS[t] for t in types))
    if len(payload) != size:
        with pytest.raises(WireError, match=f"has {size}$"):
            unpack_values(types, payload)


def test_a_comma_at_the_end_names_nothing():
    assert names(b"timestamp,actual_q,") == ["timestamp", "actual_q"]
    assert names(b"") == []


def test_an_output_recipe_has_a_rate_and_names():
    assert output_setup(struct.pack(">d", 500.0) + b"actual_q,") == (500.0, ["actual_q"])
    for bad in (b"", struct.pack(">d", 0.0), struct.pack(">d", float("nan"))):
        with pytest.raises(WireError):
            output_setup(bad)


def test_a_recipe_that_is_no_ascii_is_refused():
    with pytest.raises(WireError, match="ASCII"):
        names(b"\xff\xfe")
