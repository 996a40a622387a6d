"""Files that people write, as text: UTF-8, with a byte order mark or without; others by name.

A device, a pipe or a file without end is no file to be read at once: it is refused unopened.
"""

from pathlib import Path
from stat import S_ISBLK, S_ISCHR, S_ISDIR, S_ISFIFO, S_ISREG, S_ISSOCK

from app.errors import FlinchError

LARGEST = 64 * 2**20  # bytes of a text file
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


def check_file(path: Path, error: type[FlinchError], largest: float = LARGEST) -> None:
    """Raises `error` in one line unless there is a file of at most `largest` bytes at `path`."""
    try:
        facts = path.stat()
    except (OSError, ValueError) as e:  # a name with a zero in it is a ValueError
        why = getattr(e, "strerror", None) or str(e)
        raise error(f"{path}: cannot be read ({why}); give another file") from e
    if not S_ISREG(facts.st_mode):
        others = (
            (S_ISDIR, "a folder"), (S_ISFIFO, "a pipe"), (S_ISSOCK, "a socket"),
            (S_ISCHR, "a device"), (S_ISBLK, "a device"),
        )  # fmt: skip
        kind = next((name for is_one, name in others if is_one(facts.st_mode)), "no file")
        raise error(f"{path}: is {kind}, not a file; give a file")
    if facts.st_size > largest:
        raise error(
            f"{path}: has {facts.st_size / 2**20:.0f} MB; {largest / 2**20:g} MB at most are read"
        )


def read_file(path: Path, error: type[FlinchError], largest: int = LARGEST) -> bytes:
    """The bytes of a file; raises `error` in one line."""
    check_file(path, error, largest)
    try:
        with path.open("rb") as file:
            content = file.read(largest + 1)  # one that grows has no end either
    except OSError as e:
        raise error(f"{path}: cannot be read ({e.strerror}); give another file") from e
    if len(content) > largest:
        raise error(f"{path}: has no end; {largest / 2**20:g} MB at most are read")
    return content


def read_text(path: Path, error: type[FlinchError], largest: int = LARGEST) -> str:
    """The text of a file; raises `error` in one line."""
    try:
        return as_text(path, read_file(path, error, largest), error)
    except UnicodeDecodeError as e:
        raise error(f"{path}: is not UTF-8 text; save it as UTF-8, or give another file") from e


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
