"""Every kind of print at every chunking: the right zones come of it, or none."""

import numpy as np
import pytest

from app.sensing.wire.described import Print
from app.sensing.wire.detect import FORMATS, Detector
from app.sensing.wire.reader import TextReader
from tests.text_streams import FRAMES, all_streams

STREAMS = [(side, stream) for side in (8, 4) for stream in all_streams(side)]
IDS = [f"{side} {stream.name}" for side, stream in STREAMS]
CHUNKS = (1, 7, 64, 1 << 20)


def decoder_of(how, side):
    grids = ((side, side), (8, 8), (4, 4))
    return TextReader(how, grids) if isinstance(how, Print) else FORMATS[how].decoder(grids)


def fed(decoder, data, size):
    return [f for i in range(0, len(data), size) for f in decoder.feed(data[i : i + size])]


def is_right(frame, right):
    """Distances and statuses of the zones that have a target; the others say so."""
    distance, status = right
    seen = status != 255
    return np.array_equal(frame.status, status) and np.array_equal(
        frame.distance[seen], distance[seen]
    )


def test_the_matrix_is_as_large_as_it_should_be():
    assert len(STREAMS) >= 120 and len(set(IDS)) == len(IDS)


@pytest.mark.parametrize(("side", "stream"), STREAMS, ids=IDS)
def test_every_stream_is_read_as_it_was_printed_at_any_chunking(side, stream):
    for size in CHUNKS:
        got = fed(decoder_of(stream.how, side), stream.data, size)
        assert [f.grid for f in got] == [(side, side)] * FRAMES
        for frame, right in zip(got, stream.right, strict=True):
            assert is_right(frame, right)


@pytest.mark.parametrize(("side", "stream"), STREAMS, ids=IDS)
def test_what_is_not_named_is_read_right_or_refused_with_the_names(side, stream):
    detector = Detector()
    got = fed(detector, stream.data, 50)
    for frame in got:
        assert any(is_right(frame, right) for right in stream.right)
    if not got:
        assert detector.trouble == "" or "PORT#" in detector.trouble or "#" in detector.trouble
