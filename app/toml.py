"""TOML files into checked values, with errors that name the file, the key and the remedy."""

from pathlib import Path
from typing import TypeVar

import msgspec

from app.errors import FlinchError

T = TypeVar("T")


class Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of every TOML table: keys are typed, unknown keys are refused."""


def read_toml(path: Path, kind: type[T], error: type[FlinchError]) -> T:
    """The file at `path` as a `kind` (a `Table`); raises `error` in one line otherwise."""
    try:
        content = path.read_bytes()
    except OSError as e:
        raise error(f"{path}: cannot be read ({e.strerror}); give another file") from e
    try:
        return msgspec.toml.decode(content, type=kind)
    except msgspec.ValidationError as e:
        raise error(f"{path}: {_lower(str(e))}; mend that entry ({_keys(kind)})") from e
    except (msgspec.DecodeError, UnicodeDecodeError) as e:
        raise error(f"{path}: not valid TOML ({e}); mend that line") from e


def _keys(kind: type) -> str:
    return "keys here: " + ", ".join(f.name for f in msgspec.structs.fields(kind))


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
