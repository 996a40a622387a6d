"""Values into bytes and back: to the last bit, and nothing but what `app.record.kinds` lists.

MessagePack, in which every sequence begins with what it is: a small number, or the name of a
frozen dataclass whose fields follow in their order. That order stands once in the recording
(`NAMES`), so that a field that was renamed since is found, and one that is unknown is told.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields
from enum import Enum
from operator import attrgetter
from pathlib import Path, PosixPath
from typing import Any, TypeVar

import msgspec
import numpy as np

from app.actions import SetParams
from app.errors import FlinchError, RecordingError
from app.messages import freeze
from app.record.kinds import CHOICES, NAMES, VALUES, changes_now, renamed

T = TypeVar("T")
TUPLE, LIST, DICT, ARRAY, SCALAR, ENUM, PATH, LARGE, TEXT = range(9)
NUMERIC = "biuf"  # kinds of numpy's numbers
MANY = 1 << 63  # whole numbers beyond are written as text
_pack, _unpack = msgspec.msgpack.Encoder().encode, msgspec.msgpack.Decoder().decode


def encode(value: Any) -> bytes:
    """Bytes of a value; RecordingError for one that cannot be in a recording."""
    return _pack(_plain(value))


class Decoder:
    """Reads what `encode` wrote; `names`: the fields by kind, as the recording has them."""

    def __init__(self, names: Mapping[str, Sequence[str]] = NAMES) -> None:
        self._names = names
        self._plans: dict[str, Callable[[list[Any]], Any]] = {}
        self._ways: dict[int, Callable[[list[Any]], Any]] = {
            TUPLE: lambda plain: tuple(self._parts(plain)), LIST: self._parts, DICT: self._mapping,
            ARRAY: _to_array, SCALAR: lambda p: np.frombuffer(p[2], _numbers(p[1]))[0],
            ENUM: lambda p: CHOICES[p[1]](p[2]), PATH: lambda p: Path(p[1]),
            LARGE: lambda p: int(p[1]), TEXT: lambda p: p[1].decode("utf-8", "surrogatepass"),
        }  # fmt: skip

    def decode(self, data: bytes, kind: type[T]) -> T:
        """The value; RecordingError if it is none, or of another kind."""
        try:
            value = self._value(_unpack(data))
        except FlinchError as e:
            raise e if isinstance(e, RecordingError) else RecordingError(f"{e}") from e
        except Exception as e:  # whatever rubbish does to msgspec, numpy and dataclasses
            raise RecordingError(f"the recording is damaged: no {kind.__name__} here ({e})") from e
        if type(value) is not kind:
            raise RecordingError(
                f"the recording is damaged: a {type(value).__name__} instead of a {kind.__name__}"
            )
        return value

    def _value(self, plain: Any) -> Any:
        if type(plain) is not list:
            return plain
        tag = plain[0]
        if type(tag) is str:
            return self._plan(tag)(plain)
        if tag not in self._ways:
            raise RecordingError(
                f"the recording is damaged: {plain[:2]!r} is nothing that is known"
            )
        return self._ways[tag](plain)

    def _parts(self, plain: list[Any]) -> list[Any]:
        return [self._value(v) for v in plain[1:]]

    def _mapping(self, plain: list[Any]) -> dict[Any, Any]:
        parts = self._parts(plain)
        return dict(zip(parts[::2], parts[1::2], strict=True))

    def _plan(self, name: str) -> Callable[[list[Any]], Any]:
        plan = self._plans.get(name)
        if plan is None:
            plan = self._plans[name] = self._planned(name)
        return plan

    def _planned(self, name: str) -> Callable[[list[Any]], Any]:
        """How to make a value of the kind `name` of its fields as they were recorded."""
        if name not in VALUES or name not in self._names:
            raise RecordingError(
                f"the recording holds a {name!r}, which is not known here; "
                "it was made by another version of Flinch"
            )
        kind, value = VALUES[name], self._value
        now = [renamed(name, old) for old in self._names[name]]
        given = set(now)
        lacking = [f.name for f in fields(kind) if f.name not in given and _required(f)]
        if lacking or len(given) != len(now):
            raise RecordingError(
                f"the recording has no {name}.{', '.join(lacking)}; "
                "it was made by another version of Flinch"
            )
        if kind is SetParams:
            return lambda plain: SetParams(changes_now(value(plain[1])))
        if tuple(now) == NAMES[name]:
            return lambda plain: kind(*[value(v) for v in plain[1:]])

        def made(plain: list[Any]) -> Any:
            return kind(**dict(zip(now, [value(v) for v in plain[1:]], strict=True)))

        return made


def _to_array(plain: list[Any]) -> np.ndarray:
    _, kind, shape, data = plain
    return freeze(np.frombuffer(data, _numbers(kind)).reshape(shape).copy())  # copied: aligned


def _required(f: Any) -> bool:
    return f.default is MISSING and f.default_factory is MISSING


def _numbers(kind: Any) -> "np.dtype[Any]":
    """A type of numbers by its name, such as '<f8'."""
    numbers: np.dtype[Any] = np.dtype(kind)
    if type(kind) is not str or numbers.kind not in NUMERIC or numbers.str != kind:
        raise RecordingError(f"the recording is damaged: {kind!r} is no kind of number")
    return numbers


# --- into plain values -----------------------------------------------------------------------


def _plain(value: Any) -> Any:
    return _WAYS.get(type(value), _other)(value)


def _same(value: Any) -> Any:
    return value


def _text(value: str) -> Any:
    if value.isascii():
        return value
    try:
        value.encode()
    except UnicodeEncodeError:  # half a character, as a browser may send it
        return [TEXT, value.encode("utf-8", "surrogatepass")]
    return value


def _int(value: int) -> Any:
    return value if -MANY <= value < MANY else [LARGE, str(value)]


def _tuple(value: tuple[Any, ...]) -> Any:
    return [TUPLE, *map(_plain, value)]


def _list(value: list[Any]) -> Any:
    return [LIST, *map(_plain, value)]


def _dict(value: dict[Any, Any]) -> Any:
    return [DICT, *(_plain(part) for item in value.items() for part in item)]


def _array(value: np.ndarray) -> Any:
    if value.dtype.kind not in NUMERIC:
        raise RecordingError(f"an array of {value.dtype} cannot be recorded; only numbers can")
    return [ARRAY, value.dtype.str, value.shape, value.tobytes()]


def _enum(value: Enum) -> Any:
    return [ENUM, type(value).__name__, value.value]


def _path(value: Path) -> Any:
    return [PATH, str(value)]


def _fields_of(name: str, kind: type) -> Callable[[Any], Any]:
    names = NAMES[name]
    if not names:
        return lambda value: [name]
    look = attrgetter(*names)
    if len(names) == 1:
        return lambda value: [name, _plain(look(value))]
    return lambda value: [name, *map(_plain, look(value))]


def _other(value: Any) -> Any:
    if isinstance(value, np.generic) and value.dtype.kind in NUMERIC:
        return [SCALAR, value.dtype.str, value.tobytes()]
    raise RecordingError(f"a {type(value).__name__} cannot be recorded")


_WAYS: dict[type, Callable[[Any], Any]] = {
    **dict.fromkeys((type(None), bool, float, bytes), _same),
    **dict.fromkeys(CHOICES.values(), _enum),
    **{kind: _fields_of(name, kind) for name, kind in VALUES.items()},
    str: _text, int: _int, tuple: _tuple, list: _list, dict: _dict, np.ndarray: _array,
    Path: _path, PosixPath: _path,
}  # fmt: skip
