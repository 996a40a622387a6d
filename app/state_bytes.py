"""A captured state as plain bytes, and back: into the parts of another object of the same make.

Nothing in them can run. Of classes only names are written, and reading makes instances of those
alone that the new object is made of already or that the reader lists; no code of theirs runs.
What is not state (facts, functions) is taken from the new object, where it lies at the same place.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import msgspec
import numpy as np

from app.digest import parts_of
from app.errors import RecordingError
from app.state import PLAIN, Facts, Held, State, capture

# what a node of the graph is; its number is its place in the list of all
ARRAY, SCALAR, ENUM, FACT, TUPLE, LIST, DICT, COUNTER, SET, FROZEN_SET, DEQUE, OBJECT = range(12)
SIMPLE = (bool, int, float, str, bytes, type(None))  # written as they are; the rest as [number]
SEQUENCES: dict[type, int] = {tuple: TUPLE, list: LIST, set: SET, frozenset: FROZEN_SET}
NUMERIC = "biuf"
PACKAGE = __name__.partition(".")[0]
OTHER = "the recording begins in the middle of a run, with a state that does not fit"


def to_bytes(state: State, facts: Facts) -> bytes:
    """All of a captured state; TypeError for what it cannot hold. In any thread."""
    return msgspec.msgpack.encode(_Writer(state, facts).nodes)


def from_bytes(data: bytes, root: dict[str, Any], facts: Facts, kinds: Iterable[type]) -> State:
    """The state for `root`, the attributes of a new object; to be put back with `restore`.

    kinds: classes that a state may hold though the new object does not.
    Raises RecordingError where the bytes are damaged, or of an object of another make.
    """
    reader = _Reader(root, facts, kinds)
    try:
        built = reader.read(msgspec.msgpack.decode(data))
    except RecordingError:
        raise
    except Exception as e:  # whatever rubbish does to msgspec, numpy and to recursion
        raise RecordingError(f"{OTHER} ({e!r:.80})") from e
    if type(built) is not dict or set(built) != set(root):
        raise RecordingError(f"{OTHER}: it is of something else")
    state = capture(built, facts)
    held = tuple(Held(root, h.content) if h.part is built else h for h in state.held)
    return State(root, held, state.arrays)


def places(root: Any, facts: Facts) -> tuple[dict[int, list[str]], dict[str, Any], set[type]]:
    """What is not state, with the places where it lies, by identity and by place; and the
    classes of all that is."""
    by_id: dict[int, list[str]] = {}
    by_place: dict[str, Any] = {}
    classes: set[type] = set()
    seen: dict[int, Any] = {}
    ahead = [("", root)]
    while ahead:
        place, value = ahead.pop()
        if is_fact(value, facts):
            by_id.setdefault(id(value), []).append(place)
            by_place[place] = value
            continue
        classes.add(type(value))
        if isinstance(value, (*PLAIN, np.ndarray)) or id(value) in seen:
            continue
        seen[id(value)] = value
        ahead += [(f"{place}/{name}", part) for name, part in parts_of(value)]
    return by_id, by_place, classes


def is_fact(value: Any, facts: Facts) -> bool:
    """Is it no state?"""
    return isinstance(value, facts) or callable(value)


def name_of(kind: type) -> str:
    """How a class is written: ours as in a checkout, whatever the installed package is called
    (see `hatch_build.py`)."""
    package, _, room = kind.__module__.partition(".")
    package = "app" if package == PACKAGE else package
    return ".".join(filter(None, (package, room, kind.__qualname__)))


class _Writer:
    """Makes the list of nodes; a part that is met again is its number."""

    def __init__(self, state: State, facts: Facts) -> None:
        self.nodes: list[Any] = []
        self._facts = facts
        self._content = {id(h.part): h.content for h in state.held}
        self._copies = {id(array): copy for array, copy in state.arrays}
        self._places, _, _ = places(state.root, facts)
        self._numbers: dict[int, int] = {}
        self._alive: list[Any] = []  # or an id would name another one
        self.value(state.root)

    def value(self, value: Any) -> Any:
        """How a value is written where it is a part."""
        if type(value) in SIMPLE:
            return value
        number = self._numbers.get(id(value))
        if number is None:
            number = self._numbers[id(value)] = len(self.nodes)
            self._alive.append(value)
            self.nodes.append(None)  # its place: parts follow, and may come back to it
            self.nodes[number] = self._node(value)
        return [number]

    def _node(self, value: Any) -> list[Any]:
        if is_fact(value, self._facts):
            return [FACT, self._places[id(value)]]
        if isinstance(value, Enum):
            return [ENUM, name_of(type(value)), value.value]
        if isinstance(value, np.ndarray | np.generic):
            return self._numeric(value)
        kind, content = type(value), self._content.get(id(value), value)
        if kind in SEQUENCES:
            return [SEQUENCES[kind], *map(self.value, content)]
        if kind is deque:
            return [DEQUE, value.maxlen, *map(self.value, content)]
        if kind in (dict, Counter):
            pairs = [self.value(part) for item in content.items() for part in item]
            return [DICT if kind is dict else COUNTER, *pairs]
        return self._object(value, content)

    def _numeric(self, value: Any) -> list[Any]:
        if value.dtype.kind not in NUMERIC:
            raise TypeError(f"the state has values of {value.dtype}; only numbers can be written")
        if isinstance(value, np.generic):
            return [SCALAR, value.dtype.str, value.tobytes()]
        copy = self._copies.get(id(value), value)
        return [ARRAY, value.dtype.str, value.shape, value.flags.writeable, copy.tobytes()]

    def _object(self, value: Any, content: Any) -> list[Any]:
        kind = type(value)
        if isinstance(value, tuple):  # with names
            names: Iterable[str] = kind._fields
        elif isinstance(content, Mapping):
            names, content = content.keys(), content.values()
        else:
            names = [f.name for f in fields(kind)]
            content = [getattr(value, n) for n in names] if content is value else content
        parts = [self.value(part) for part in content]
        return [OBJECT, name_of(kind), list(names), parts]


class _Reader:
    """Makes the parts again, of nothing but known classes."""

    def __init__(self, root: dict[str, Any], facts: Facts, kinds: Iterable[type]) -> None:
        _, self._facts, classes = places(root, facts)
        self._kinds = {name_of(kind): kind for kind in (*classes, *kinds)}
        self._nodes: list[Any] = []
        self._made: dict[int, Any] = {}
        self._making: set[int] = set()
        self._ways: dict[int, Callable[[int, list[Any]], Any]] = {
            ARRAY: self._array, SCALAR: self._scalar, ENUM: self._enum, FACT: self._fact,
            TUPLE: lambda _, p: tuple(self._all(p)), SET: lambda _, p: set(self._all(p)),
            FROZEN_SET: lambda _, p: frozenset(self._all(p)), LIST: self._list,
            DEQUE: self._deque, DICT: self._dict, COUNTER: self._counter, OBJECT: self._object,
        }  # fmt: skip

    def read(self, nodes: list[Any]) -> Any:
        """The root."""
        self._nodes = nodes
        return self._part([0])

    def _part(self, written: Any) -> Any:
        if type(written) is not list:
            return written
        (number,) = written
        if number in self._made:
            return self._made[number]
        if number in self._making or type(number) is not int or number < 0:
            raise RecordingError(f"{OTHER}: it goes round in a circle")
        self._making.add(number)
        tag, *content = self._nodes[number]
        self._made[number] = made = self._ways[tag](number, content)
        self._making.discard(number)
        return made

    def _all(self, written: list[Any]) -> list[Any]:
        return [self._part(w) for w in written]

    def _array(self, _: int, content: list[Any]) -> Any:
        kind, shape, writeable, data = content
        array = np.frombuffer(data, _numeric(kind)).reshape(shape).copy()
        array.flags.writeable = bool(writeable)
        return array

    def _scalar(self, _: int, content: list[Any]) -> Any:
        return np.frombuffer(content[1], _numeric(content[0]))[0]

    def _enum(self, _: int, content: list[Any]) -> Any:
        kind = self._kind(content[0])
        if not issubclass(kind, Enum):
            raise RecordingError(f"{OTHER}: {content[0]} is no choice")
        return kind(content[1])

    def _fact(self, _: int, content: list[Any]) -> Any:
        for place in content[0]:
            if place in self._facts:
                return self._facts[place]
        raise RecordingError(f"{OTHER}: nothing lies at {content[0][:1]}")

    def _list(self, number: int, content: list[Any]) -> Any:
        made = self._made[number] = []
        made.extend(self._all(content))
        return made

    def _deque(self, number: int, content: list[Any]) -> Any:
        made = self._made[number] = deque(maxlen=content[0])
        made.extend(self._all(content[1:]))
        return made

    def _dict(self, number: int, content: list[Any]) -> Any:
        made = self._made[number] = {}
        parts = self._all(content)
        made.update(zip(parts[::2], parts[1::2], strict=True))
        return made

    def _counter(self, number: int, content: list[Any]) -> Any:
        made: Counter[Any] = Counter()
        self._made[number] = made
        parts = self._all(content)
        dict.update(made, zip(parts[::2], parts[1::2], strict=True))
        return made

    def _object(self, number: int, content: list[Any]) -> Any:
        name, names, written = content
        kind: Any = self._kind(name)
        if issubclass(kind, tuple) and hasattr(kind, "_fields"):
            _same_names(name, names, kind._fields)
            return kind(*self._all(written))
        if issubclass(kind, (*PLAIN, np.ndarray, *BUILT_IN)):
            raise RecordingError(f"{OTHER}: {name} is no object")
        if is_dataclass(kind):
            _same_names(name, names, [f.name for f in fields(kind)])
        made = self._made[number] = object.__new__(kind)
        for attribute, part in zip(names, self._all(written), strict=True):
            if not is_dataclass(kind) and (type(attribute) is not str or hasattr(kind, attribute)):
                raise RecordingError(f"{OTHER}: {attribute!r} is no attribute of {name}")
            object.__setattr__(made, attribute, part)
        return made

    def _kind(self, name: str) -> type:
        if name not in self._kinds:
            raise RecordingError(f"{OTHER}: {name} is not part of it here")
        return self._kinds[name]


BUILT_IN = (tuple, list, dict, set, frozenset, deque)


def _same_names(kind: str, given: list[str], known: Iterable[str]) -> None:
    if list(given) != list(known):
        raise RecordingError(f"{OTHER}: {kind} has other parts here")


def _numeric(kind: Any) -> "np.dtype[Any]":
    numbers: np.dtype[Any] = np.dtype(kind)
    if type(kind) is not str or numbers.kind not in NUMERIC:
        raise RecordingError(f"{OTHER}: {kind!r} is no kind of number")
    return numbers
