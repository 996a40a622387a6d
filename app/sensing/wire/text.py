"""Bytes into lines, whatever the chunks and the ends of lines, with a bounded rest."""

import re

LONGEST = 4096  # bytes of a line; a debug line of 256 zones has up to 2900
OVERLONG = "?"  # stands for a line that is longer: it belongs to no format
HOME = "\f"  # stands for an escape that takes the cursor home or clears the screen
# LF, CR LF, LF CR, CR CR LF: each line feed ends one line with the returns beside it
END = re.compile(rb"\r*\n\r*|\r+")
TOP = re.compile(r"\x1b\[[0-9;]*[HfJ]|\x1bc|\x0c")
ESCAPE = re.compile(r"\x1b\[[0-9;?]*[ -/]*[@-~]|\x1b[@-Z\\-_]|\x1b\][^\x07]*\x07")


class Lines:
    """Splits a stream at the ends of lines. The first line may have been joined in its middle and
    is left out."""

    def __init__(self) -> None:
        self._rest = b""
        self._joined = False
        self._returned = False  # the last line ended with a return: its line feed may follow

    def feed(self, chunk: bytes) -> list[str]:
        """Lines that are complete, without their ends and escapes; what is no ASCII is replaced.

        A line that takes the cursor home gives `HOME` before what follows the escape.
        """
        data = self._rest + chunk
        if not self._rest:  # an end of a line that a chunk has cut is no other line's
            data = data.lstrip(b"\r")
            if self._returned and data:
                data, self._returned = data.removeprefix(b"\n"), False
        if b"\n" not in chunk and b"\r" not in chunk:
            self._rest = data[: LONGEST + 1]
            return []
        *whole, rest = END.split(data) if b"\r" in data else data.split(b"\n")
        self._rest = rest[: LONGEST + 1]
        if whole and not rest:
            self._returned = not data.rstrip(b"\r").endswith(b"\n")
        if whole and not self._joined:
            self._joined = True
            whole = whole[1:]
        lines: list[str] = []
        for line in whole:
            if len(line) > LONGEST:
                lines.append(OVERLONG)
            elif b"\x1b" in line or b"\x0c" in line:
                lines += _without_escapes(line.decode("ascii", "replace"))
            else:
                lines.append(line.decode("ascii", "replace"))
        return lines


def _without_escapes(line: str) -> list[str]:
    """What is seen of a line, `HOME` where the cursor goes home."""
    if not TOP.search(line):
        return [ESCAPE.sub("", line)]
    before, *parts = TOP.split(line)
    out = [ESCAPE.sub("", before)] if before or not parts else []
    for part in parts:
        out.append(HOME)
        if seen := ESCAPE.sub("", part):
            out.append(seen)
    return out
