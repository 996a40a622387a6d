"""Which format speaks? Every decoder is fed; the first that yields a whole frame is the one."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from app.errors import SensorError, options
from app.sensing.wire import binary, f_line, lines, table
from app.sensing.wire.raw import USUAL, Decoder, Grid, RawFrame


@dataclass(frozen=True, slots=True)
class Format:
    """A format: its decoder for some grids, its encoder, its usual speed [baud], and what it tells.

    named:  its frames say which sensor they are of.
    status: its frames say how far each zone can be trusted.
    """

    make: Callable[[Sequence[Grid]], Decoder]
    encode: Callable[[RawFrame], bytes]
    baud: int
    named: bool = False
    status: bool = True

    def decoder(self, grids: Sequence[Grid] = USUAL) -> Decoder:
        """A decoder for sensors of these grids; a format that tells its grid reads any."""
        return self.make(grids)


FORMATS = {
    "binary": Format(lambda _: binary.Binary(), binary.encode, 2_000_000, named=True),
    "f": Format(f_line.FLines, f_line.encode, 921_600, named=True),
    "table": Format(lambda grids: table.RangingTable(True, grids), table.encode, 460_800),
    "table-plain": Format(
        lambda grids: table.RangingTable(False, grids),
        lambda frame: table.encode(frame, mirrored=False),
        460_800,
    ),
    "lines": Format(
        lambda grids: lines.NumberLines(True, grids), lines.encode, 115_200, status=False
    ),
    "lines-plain": Format(
        lambda grids: lines.NumberLines(False, grids),
        lambda frame: lines.encode(frame, mirrored=False),
        115_200,
        status=False,
    ),
}
TRIED = ("binary", "f", "table", "lines")  # a format's plain sister looks the same on the wire


def format_of(name: str) -> Format:
    """A format by name; the error lists the names."""
    if name not in FORMATS:
        raise SensorError(f"no format {name!r} of serial skins; {options(name, FORMATS)}")
    return FORMATS[name]


class Detector:
    """A decoder of whatever speaks: `name` is empty until a whole frame has come."""

    def __init__(self, name: str = "", grids: Sequence[Grid] = USUAL) -> None:
        self.name = name
        self._decoders = {n: format_of(n).decoder(grids) for n in ([name] if name else TRIED)}

    @property
    def refused(self) -> Counter[str]:
        """What the chosen decoder did not accept, by reason; nothing before one is chosen."""
        return self._decoders[self.name].refused if self.name else Counter()

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames of the format that speaks."""
        for name, decoder in self._decoders.items():
            frames = decoder.feed(chunk)
            if frames:
                if not self.name:
                    self.name, self._decoders = name, {name: decoder}
                return frames
        return []
