"""Coverage-guided fuzzing of the decoders: `make fuzz`, with the extra `fuzz` installed.

Every input is a stream: its first two bytes choose the decoder, the chunking, and whether a whole
frame stands inside of the garbage. Four things must hold: no exception; no binary frame whose own
bytes are not in the stream (so its checksum has been seen); a bounded rest; and after the garbage
the next whole frame is read, unless a text reader has found that the garbage is no such print.
"""

import json
import sys
import time
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["app.sensing.wire", "app.sensing.device_clock"]):
    from app.sensing.stream import Stream
    from app.sensing.wire import binary
    from app.sensing.wire.described import Print, Status
    from app.sensing.wire.detect import FORMATS, Detector
    from app.sensing.wire.reader import TextReader

import numpy as np

from app.sensing.wire.raw import RawFrame

KEPT = 5000  # bytes and numbers that a decoder may hold between two chunks
SIZES = (7, 64, 209, 210, 1 << 16)
RISING = np.arange(64, dtype=np.int16) * 30 + 100
WHOLE = RawFrame(7, 41, 123_456_789, (8, 8), RISING, np.full(64, 5, dtype=np.uint8), 30)
SAID = {name: style.encode(WHOLE) for name, style in FORMATS.items()}
DESCRIBED = {
    "alternate": Print(status=Status.ALTERNATE, unit=10.0),
    "after": Print(columns=True, status=Status.AFTER, skip=1),
    "sensors": Print(from_bottom=True, sensors=("A", "B2")),
}
# binary twice: its promise is the strongest
NAMES = (*FORMATS, *DESCRIBED, "binary", "any", "stream")
counts = dict.fromkeys(("inputs", "bytes", "accepted", "refused"), 0)
began = time.time()


def one_input(data: bytes) -> None:
    """One decoder on one stream."""
    counts["inputs"] += 1
    counts["bytes"] += len(data)
    if len(data) < 2:
        return
    name, how, stream = NAMES[data[0] % len(NAMES)], data[1], data[2:]
    size = SIZES[how % len(SIZES)]
    if how & 64:  # garbage before and behind a frame, which may be damaged itself
        packet = bytearray(SAID.get(name, SAID["binary"]))
        if how & 128 and stream:
            packet[stream[0] % len(packet)] ^= stream[-1]
        stream = stream[: len(stream) // 2] + bytes(packet) + stream[len(stream) // 2 :]
    chunks = [stream[i : i + size] for i in range(0, len(stream), size)]
    if name == "stream":
        whole = Stream()
        for i, chunk in enumerate(chunks):
            assert all(a.stamp <= 0.01 * i for a in whole.feed(chunk, 0.01 * i))
        return
    if name == "any":
        detector = Detector()
        for chunk in chunks:
            detector.feed(chunk)
        return
    decoder = TextReader(DESCRIBED[name]) if name in DESCRIBED else FORMATS[name].decoder()
    for chunk in chunks:
        for frame in decoder.feed(chunk):
            counts["accepted"] += 1
            assert name != "binary" or binary.encode(frame)[:-1] in stream, "a wrong frame"
            zones = frame.grid[0] * frame.grid[1]
            assert frame.distance.shape == frame.status.shape == (zones,)
    assert held(decoder) < KEPT, f"{name} keeps too much"
    counts["refused"] += decoder.refused.total()
    assert len(decoder.refused) < 10 and len(decoder.trouble) < 400
    if name in DESCRIBED or decoder.trouble:
        return
    # a delimiter, or ends of lines, show where a frame begins
    before, after = (b"\0", b"") if name == "binary" else (b"\n\n\n", b"\n")
    decoder.feed(before)
    got = decoder.feed(SAID[name] + after)
    if decoder.trouble or (not got and name.startswith("json")):
        return
    (frame,) = got
    assert frame.distance.tobytes() == WHOLE.distance.tobytes(), f"{name} lost the next frame"


def held(decoder: object) -> int:
    """Bytes and numbers that a decoder keeps."""
    rest = getattr(decoder, "_rest", b"") + getattr(getattr(decoder, "_lines", None), "_rest", b"")
    block = getattr(decoder, "_block", [])
    rows = block.rows + block.codes if hasattr(block, "rows") else block
    return len(rest) + len(getattr(decoder, "_heading", "")) + sum(map(len, rows))


def main() -> None:
    """Fuzz until the given number of runs is done, and tell what was done as one object."""
    runs = next((int(a.split("=")[1]) for a in sys.argv if a.startswith("-runs=")), 0)
    for said in SAID.values():  # the formats themselves first, whole and cut
        for k in range(len(NAMES)):
            for how in range(0, 256, 7):
                one_input(bytes([k, how]) + said[how % 50 :])
    for folder in (Path(a) for a in sys.argv[1:] if not a.startswith("-")):
        folder.mkdir(parents=True, exist_ok=True)
        for k, name in enumerate(FORMATS):
            (folder / name).write_bytes(bytes([k, 4]) + SAID[name])
    seeds = counts["inputs"]

    def counted(data: bytes) -> None:
        one_input(data)
        if counts["inputs"] == seeds + runs:
            print(json.dumps({"what": "fuzz wire", "seconds": round(time.time() - began)} | counts))
            sys.stdout.flush()

    atheris.Setup(sys.argv, counted)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
