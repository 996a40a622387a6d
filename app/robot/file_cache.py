"""Files that take a moment to make, kept in the user's cache folder by what they follow from.

A folder of it holds one set of files and `SHA256SUMS`, as `sha256sum` writes it. What does not
agree with its sums was damaged or left half done, and is made anew. Nothing in it is executed.
"""

import atexit
import hashlib
import logging
import os
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path

from app.paths import cache_home

log = logging.getLogger(__name__)
SUMS = "SHA256SUMS"
MOST = 100  # sets of one kind; the least used one goes first


def cached_folder(kind: str, key: str, make: Callable[[Path], None]) -> Path:
    """The folder with the files that `make` writes into a folder, made once for a `key`.

    kind, key: names of folders; the key should be a digest of all that the files follow from.
    Where the cache cannot be written to, a folder that lasts as long as the process serves.
    """
    shelf = _shelf(kind)
    try:
        return _made(shelf, key, make)
    except OSError as e:
        log.warning("%s cannot be kept in %s (%s); make room there", kind, shelf, e.strerror)
    return _made(_passing() / kind, key, make)


def _made(shelf: Path, key: str, make: Callable[[Path], None]) -> Path:
    """The folder of a key on a shelf; an OSError where it cannot be written."""
    shelf.mkdir(parents=True, exist_ok=True)
    folder = shelf / key
    if not is_whole(folder):
        fresh = Path(tempfile.mkdtemp(prefix=f".{key}-", dir=shelf))
        try:
            make(fresh)
            (fresh / SUMS).write_text(_sums(fresh))
            shutil.rmtree(folder, ignore_errors=True)
            with suppress(OSError):  # another process was faster: its files are the same
                fresh.rename(folder)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)
    with suppress(OSError):  # it may be read, and not be written to
        os.utime(folder)
        _forget(shelf)
    return folder


def is_whole(folder: Path) -> bool:
    """Are all files here, and none of them damaged?"""
    try:
        return (folder / SUMS).read_text() == _sums(folder)
    except (OSError, UnicodeDecodeError):
        return False


def _sums(folder: Path) -> str:
    files = sorted(f for f in folder.iterdir() if f.name != SUMS)
    return "".join(f"{hashlib.sha256(f.read_bytes()).hexdigest()}  {f.name}\n" for f in files)


def _forget(shelf: Path) -> None:
    sets = [f for f in shelf.iterdir() if not f.name.startswith(".")]
    for old in sorted(sets, key=lambda f: f.stat().st_mtime)[:-MOST]:
        shutil.rmtree(old, ignore_errors=True)


def _shelf(kind: str) -> Path:
    shelf = cache_home() / "flinch" / kind
    try:
        shelf.mkdir(parents=True, exist_ok=True)
        if os.access(shelf, os.W_OK):
            return shelf
    except OSError:
        pass  # no home, or one that is read only
    return _passing() / kind


@cache
def _passing() -> Path:
    """A folder that goes with the process."""
    folder = Path(tempfile.mkdtemp(prefix="flinch-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
