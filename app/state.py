"""The whole changing state of an object, kept in memory and put back in place.

The walk is that of `app.digest`: attributes, sequences and mappings down to numbers, texts and
arrays; what an object was built from and never changes is told apart by its type and stays shared.
Objects keep their identity: a state is put back into the very parts that it was taken from, so
that whoever shares an array or a list shares it again. `app.state_bytes` makes bytes of it.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

PLAIN = (bool, int, float, str, bytes, type(None), np.generic, Enum)
Facts = tuple[type, ...]
ALIGNED = 64  # [bytes] where a copy begins


class Held(NamedTuple):
    """A part that can change, and a shallow copy of what it held."""

    part: Any
    content: Any


@dataclass(frozen=True, eq=False, slots=True)
class State:
    """What `capture` has seen.

    root:   what it was taken of.   held: every part of it that can change, the root among them.
    arrays: every array that can be written to, and a copy of its values.
    """

    root: Any
    held: tuple[Held, ...]
    arrays: tuple[tuple[NDArray[Any], NDArray[Any]], ...]

    @property
    def size(self) -> int:
        """Bytes of the arrays that were copied."""
        return sum(copy.nbytes for _, copy in self.arrays)


class Room:
    """Memory for the copies of one state, taken from the system before it is needed.

    Fresh memory is what a copy waits for: 3 MB take 4 ms, and 0.7 ms once they were used.
    """

    def __init__(self, size: int = 1 << 23) -> None:
        """size: [bytes]; what finds no room is copied as anywhere else."""
        self._memory = np.ones(size, dtype=np.uint8)
        self._used = 0

    def clear(self) -> None:
        """What was copied here is not needed any more."""
        self._used = 0

    def copy(self, array: NDArray[Any]) -> NDArray[Any]:
        """A copy, in here as long as there is room."""
        start = -(-self._used // ALIGNED) * ALIGNED
        end = start + array.nbytes
        if end > len(self._memory):
            return array.copy()
        self._used = end
        copy = self._memory[start:end].view(array.dtype).reshape(array.shape)
        np.copyto(copy, array)
        return copy


def capture(root: Any, facts: Facts = (), room: Room | None = None) -> State:
    """Everything that can change and is reachable from `root`, but for instances of `facts`.

    Read-only arrays are shared, not copied: nobody writes to what is frozen. `room` is cleared
    and used for the copies. Raises TypeError for what it does not know how to read, as `digest`.
    """
    kind_of, seen = _kinds(facts), {id(root)}
    copied: Callable[[NDArray[Any]], NDArray[Any]] = np.copy
    if room is not None:
        room.clear()
        copied = room.copy
    held: list[Held] = []
    arrays: list[tuple[NDArray[Any], NDArray[Any]]] = []
    ahead = [root]
    while ahead:
        part = ahead.pop()
        kind = kind_of(type(part))
        if kind is _ARRAY:
            if not frozen(part):
                arrays.append((part, copied(part)))
            continue
        content, parts = kind.look(part)
        if kind.changes:
            held.append(Held(part, content))
        for p in parts:
            if kind_of(type(p)) is not _NOTHING and id(p) not in seen:
                seen.add(id(p))  # all of them live on in what holds them
                ahead.append(p)
    return State(root, tuple(held), tuple(arrays))


def restore(state: State) -> None:
    """Make everything as it was; may be done as often as wanted."""
    for part, content in state.held:
        _put_back(part, content)
    for array, copy in state.arrays:
        if array.flags.writeable:  # else it is a view of another one
            array[...] = copy


def frozen(array: NDArray[Any]) -> bool:
    """Is it read-only, and what it is a view of as well?"""
    base: Any = array
    while isinstance(base, np.ndarray):
        if base.flags.writeable:
            return False
        base = base.base
    return base is None or isinstance(base, bytes)


def _put_back(part: Any, content: Any) -> None:
    if isinstance(part, dict):
        part.clear()
        dict.update(part, content)  # a Counter's own would add
    elif isinstance(part, list):
        part[:] = content
    elif isinstance(part, deque):
        part.clear()
        part.extend(content)
    elif isinstance(part, set):
        part.clear()
        part.update(content)
    elif hasattr(part, "__dict__"):
        attributes = vars(part)
        attributes.clear()
        attributes.update(content)
    else:  # a dataclass with slots
        for f, value in zip(fields(part), content, strict=True):
            setattr(part, f.name, value)


# --- how each type is read ------------------------------------------------------------------


class Kind(NamedTuple):
    """look: a part's content, and the parts that it consists of.   changes: can it?"""

    look: Callable[[Any], tuple[Any, Any]]
    changes: bool


def _nothing(part: Any) -> tuple[Any, Any]:
    return None, ()


def _of_mapping(part: Any) -> tuple[Any, Any]:
    content = dict(part)
    return content, content.values()


def _of_sequence(part: Any) -> tuple[Any, Any]:
    content = tuple(part)
    return content, content


def _of_object(part: Any) -> tuple[Any, Any]:
    content = dict(vars(part))
    return content, content.values()


_NOTHING, _ARRAY = Kind(_nothing, False), Kind(_nothing, True)


@cache
def _kinds(facts: Facts) -> Callable[[type], Kind]:
    """How to read a type, found once for each."""
    return cache(lambda kind: _kind(kind, facts))


def _kind(kind: type, facts: Facts) -> Kind:
    if issubclass(kind, (*facts, *PLAIN)) or any("__call__" in vars(c) for c in kind.__mro__):
        return _NOTHING
    if issubclass(kind, np.ndarray):
        return _ARRAY
    if issubclass(kind, Mapping):
        return Kind(_of_mapping, issubclass(kind, dict))
    if issubclass(kind, list | tuple | deque | set | frozenset):
        return Kind(_of_sequence, not issubclass(kind, tuple | frozenset))
    if is_dataclass(kind):
        return _kind_of_dataclass(kind)
    if getattr(kind, "__dictoffset__", 0):
        return Kind(_of_object, True)
    raise TypeError(f"the state of a {kind.__name__} cannot be read")


def _kind_of_dataclass(kind: type) -> Kind:
    names = [f.name for f in fields(kind)]

    def look(part: Any) -> tuple[Any, Any]:
        content = tuple([getattr(part, n) for n in names])
        return content, content

    if kind.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        return Kind(look, False)
    return Kind(_of_object, True) if getattr(kind, "__dictoffset__", 0) else Kind(look, True)
