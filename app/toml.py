"""TOML files into checked values, with errors that name the file, the entry and the remedy."""

import tomllib
from collections.abc import Iterable, Iterator
from math import isfinite
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import Meta

from app import toml_words
from app.errors import FlinchError
from app.text_file import as_text, read_file

T = TypeVar("T")
Name = Annotated[str, Meta(min_length=1)]
Positive = Annotated[float, Meta(gt=0)]
NotNegative = Annotated[float, Meta(ge=0)]
Vector = tuple[float, float, float]


class Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of every TOML table: keys are typed, unknown keys are refused.

    No key may be a number or a text with limits or else a tuple (`Positive | Vector`): msgspec 0.22
    then crashes when rubbish is collected.
    """


def read_toml(path: Path, kind: type[T], error: type[FlinchError], where: str = "") -> T:
    """The file at `path` as a `kind` (a `Table`, or dict); raises `error` in one line otherwise.

    where: how that line begins; default: the path.
    """
    content = read_file(path, error)
    try:
        raw = tomllib.loads(as_text(path, content, error))
    except ValueError as e:  # also one that is no UTF-8
        raise error(f"{path}: not valid TOML ({e}); mend that line") from e
    value: T = checked(raw, kind, where or str(path), error)
    return value


def checked(raw: Any, kind: Any, where: str, error: type[FlinchError], name: str = "") -> Any:
    """`raw`, as it comes out of a file, as a `kind`, with finite numbers only.

    Raises `error` in one line that begins with `where`; `name` is what `raw` itself is called.
    """
    try:
        value = msgspec.convert(raw, kind)
    except msgspec.ValidationError as e:
        complaint, path = toml_words.parse(str(e))
        raise error(f"{where}: {toml_words.explain(complaint, path, raw, kind, name)}") from e
    for path in _not_finite(raw):
        raise error(f"{where}: {toml_words.explain('not finite', path, raw, kind, name)}")
    return value


def _not_finite(raw: Any) -> Iterator[toml_words.Path]:
    """The ways to the numbers of a table that are infinite or not a number."""
    if isinstance(raw, float) and not isfinite(raw):
        yield ()
    steps: Iterable[tuple[toml_words.Step, Any]] = ()
    if isinstance(raw, dict):
        steps = raw.items()
    elif isinstance(raw, list | tuple):
        steps = enumerate(raw)
    for step, value in steps:
        for rest in _not_finite(value):
            yield (step, *rest)
