"""Files that people write, as text: UTF-8, with a byte order mark or without; others by name."""

from pathlib import Path

from app.errors import FlinchError

MARK = b"\xef\xbb\xbf"  # of UTF-8, as Windows editors write it
KINDS = {
    b"\xff\xfe\x00\x00": "UTF-32 text",
    b"\x00\x00\xfe\xff": "UTF-32 text",
    b"\xff\xfe": "UTF-16 text",
    b"\xfe\xff": "UTF-16 text",
    b"PK\x03\x04": "a zip archive",
    b"\x1f\x8b": "a gzip archive",
    b"7z\xbc\xaf\x27\x1c": "a 7z archive",
    b"\xfd7zXZ\x00": "an xz archive",
    b"BZh": "a bzip2 archive",
    b"\x28\xb5\x2f\xfd": "a zstd archive",
    b"\x89MCAP": "an MCAP recording",
    b"%PDF": "a PDF",
    b"\x89PNG": "a picture",
    b"\xff\xd8\xff": "a picture",
}


def as_text(path: Path, content: bytes, error: type[FlinchError]) -> str:
    """The text of a file; raises `error` in one line that names what else it is.

    Bytes that are no UTF-8 raise a UnicodeDecodeError, which is a ValueError.
    """
    for begins, kind in KINDS.items():
        if content.startswith(begins):
            remedy = "unpack it first" if "archive" in kind else "save it as UTF-8"
            raise error(f"{path}: is {kind}, not UTF-8 text; {remedy}, or give another file")
    if b"\0" in content[:4096]:
        raise error(f"{path}: is binary, not UTF-8 text; give another file")
    return content.removeprefix(MARK).decode()


def write_new(folder: Path, name: str, suffix: str, text: str) -> Path:
    """Write a new file into a folder, which is made where it is missing; where `name` is taken,
    `name-2` and so on. Nothing is ever overwritten. OSError where it cannot be."""
    folder.mkdir(parents=True, exist_ok=True)
    number = 1
    while True:
        path = folder / f"{name}{f'-{number}' if number > 1 else ''}{suffix}"
        try:
            with path.open("x", encoding="utf-8") as file:
                file.write(text)
        except FileExistsError:
            number += 1
        else:
            return path
