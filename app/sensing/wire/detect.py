"""Which format speaks? Every decoder is fed; the first that yields a whole frame is the one.

Only formats that say all of themselves are tried. Numbers whose order nobody can see make no
frame: `Detector.trouble` then says what came and which names there are.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from app.errors import SensorError, options
from app.sensing.wire import binary, f_line
from app.sensing.wire.described import Print, Status
from app.sensing.wire.described_file import read_print
from app.sensing.wire.presets import PRESETS, Preset
from app.sensing.wire.printed import rows
from app.sensing.wire.raw import USUAL, Decoder, Grid, RawFrame
from app.sensing.wire.reader import TextReader
from app.sensing.wire.shape import Shape
from app.sensing.wire.zone_lines import ZoneLines


@dataclass(frozen=True, slots=True)
class Format:
    """A format: its decoder for some grids, its encoder, its usual speed [baud], and what it tells.

    named:  its frames say which sensor they are of.
    status: its frames say how far each zone can be trusted.
    sensors: names in the layout that its own numbers of sensors mean; empty: the layout's numbers.
    """

    make: Callable[[Sequence[Grid]], Decoder]
    encode: Callable[[RawFrame], bytes]
    baud: int
    named: bool = False
    status: bool = True
    sensors: tuple[str, ...] = ()

    def decoder(self, grids: Sequence[Grid] = USUAL) -> Decoder:
        """A decoder for sensors of these grids; a format that tells its grid reads any."""
        return self.make(grids)


def _text(preset: Preset, sensors: tuple[str, ...] = ()) -> Format:
    how = preset.how
    kind = ZoneLines if how.zones else TextReader
    told = how.status is not Status.NONE
    return Format(
        lambda grids: kind(how, grids), preset.encode, preset.baud, bool(sensors), told, sensors
    )


FORMATS = {
    "binary": Format(lambda _: binary.Binary(), binary.encode, 2_000_000, named=True),
    "f": Format(f_line.FLines, f_line.encode, 921_600, named=True),
    **{name: _text(preset) for name, preset in PRESETS.items()},
}
TRIED = ("binary", "f", "table", "uld")  # what can be told from the bytes alone


def format_of(name: str) -> Format:
    """A format by name, or by the file that describes it; the error lists the names."""
    if name.endswith(".toml"):
        return _described(name)
    if name not in FORMATS:
        known = options(name, FORMATS)
        raise SensorError(f"no format {name!r} of serial skins; {known}, or a file FILE.toml")
    return FORMATS[name]


@lru_cache(maxsize=32)
def _described(name: str) -> Format:
    """The format that a file describes; it is read once, so that a port that is plugged again
    speaks as before."""
    how, sensors = read_print(Path(name).expanduser())
    return _text(Preset(how, _writer(how)), sensors)


def _writer(how: Print) -> Callable[[RawFrame], bytes]:
    return lambda frame: rows(how, frame)


class Detector:
    """A decoder of whatever speaks: `name` is empty until a whole frame has come."""

    def __init__(self, name: str = "", grids: Sequence[Grid] = USUAL) -> None:
        self.name = name
        self._decoders = {n: format_of(n).decoder(grids) for n in ([name] if name else TRIED)}
        self._shape = None if name else Shape(grids)

    @property
    def refused(self) -> Counter[str]:
        """What the chosen decoder did not accept, by reason; nothing before one is chosen."""
        return self._decoders[self.name].refused if self.name else Counter()

    @property
    def trouble(self) -> str:
        """Why what comes makes no frames, or may make none; empty while all is well."""
        said = (d.trouble for d in self._decoders.values())
        return next((t for t in said if t), self._shape.trouble if self._shape else "")

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames of the format that speaks."""
        for name, decoder in self._decoders.items():
            frames = decoder.feed(chunk)
            if frames:
                if not self.name:
                    self.name, self._decoders, self._shape = name, {name: decoder}, None
                return frames
        if self._shape:
            self._shape.feed(chunk)
        return []
