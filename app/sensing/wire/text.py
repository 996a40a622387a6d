"""Bytes into lines, whatever the chunks, with a bounded rest."""

LONGEST = 4096  # bytes of a line; a debug line of 256 zones has up to 2900
OVERLONG = "?"  # stands for a line that is longer: it belongs to no format


class Lines:
    """Splits a stream at line feeds. The first line may have been joined in its middle and is
    left out."""

    def __init__(self) -> None:
        self._rest = b""
        self._joined = False

    def feed(self, chunk: bytes) -> list[str]:
        """Lines that are complete, without their ends; what is no ASCII is replaced."""
        *whole, rest = (self._rest + chunk).split(b"\n")
        self._rest = rest[: LONGEST + 1]
        if whole and not self._joined:
            self._joined = True
            whole = whole[1:]
        return [
            line.rstrip(b"\r").decode("ascii", "replace") if len(line) <= LONGEST else OVERLONG
            for line in whole
        ]
