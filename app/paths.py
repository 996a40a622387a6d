"""Paths among other words, such as `PATH@SENSOR`: a path that exists is one, whatever its signs."""

import os
from pathlib import Path


def cache_home() -> Path:
    """The user's cache folder, which need not be there; somewhere below /nonexistent for a user
    without a home."""
    named = os.environ.get("XDG_CACHE_HOME")
    if named:
        return Path(named)
    try:
        return Path.home() / ".cache"
    except RuntimeError:
        return Path("/nonexistent/.cache")


def cut_path(text: str, signs: str) -> tuple[str, str]:
    """The longest beginning of `text` that exists and ends before one of `signs` or at its end,
    and the rest with its sign; without one, all before the first sign."""
    ends = [i for i, sign in enumerate(text) if sign in signs and i]
    for end in (len(text), *reversed(ends)):
        if _exists(text[:end]):
            return text[:end], text[end:]
    end = ends[0] if ends else len(text)
    return text[:end], text[end:]


def path_and_name(text: str) -> tuple[str, str]:
    """Of `PATH[@NAME]`."""
    path, name = cut_path(text, "@")
    return path, name[1:]


def entries(text: str) -> list[str]:
    """Of a list with commas between, which may also stand in a path that exists."""
    out: list[str] = []
    rest = text
    while True:
        cuts = [i for i, sign in enumerate(rest) if sign == ","]
        end = next((i for i in (len(rest), *reversed(cuts)) if _one(rest[:i].strip())), None)
        if end is None:
            end = cuts[0] if cuts else len(rest)
        out.append(rest[:end].strip())
        if end == len(rest):
            return out
        rest = rest[end + 1 :]


def _one(entry: str) -> bool:
    """Is it a path that exists, and what may be said of it?"""
    path, more = cut_path(entry, "@#=:")
    return "," not in more and _exists(path)


def _exists(text: str) -> bool:
    try:
        return bool(text) and Path(text).exists()
    except (OSError, ValueError):  # too long, or with a zero in it
        return False
