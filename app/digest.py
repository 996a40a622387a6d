"""One short text for the whole state of an object: equal states, equal digests.

The walk follows attributes, sequences and mappings down to numbers, texts and arrays. What an
object was built from and never changes (a robot's meshes, a kernel) is told apart by its type:
only values that can change are state.
"""

import hashlib
from collections import deque
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

PLAIN = (bool, int, float, str, bytes, type(None))


def digest(state: Any, facts: tuple[type, ...] = ()) -> str:
    """Hexadecimal digest of everything reachable from `state`, but for instances of `facts`.

    Raises TypeError for what it does not know how to read: a state that cannot be compared is
    a mistake, not an empty text.
    """
    sha = hashlib.blake2b(digest_size=8)
    _walk(state, facts, sha, {})
    return sha.hexdigest()


def _walk(value: Any, facts: tuple[type, ...], sha: Any, seen: dict[int, tuple[int, Any]]) -> None:
    if isinstance(value, facts) or callable(value):
        return
    if isinstance(value, Enum):
        value = value.value
    if isinstance(value, (*PLAIN, np.generic)):
        sha.update(f"{type(value).__name__}:{value!r};".encode())
        return
    if id(value) in seen:  # shared, or a circle: told once, then by its number
        sha.update(f"#{seen[id(value)][0]};".encode())
        return
    seen[id(value)] = len(seen), value  # kept alive, or its id would name another one
    if isinstance(value, np.ndarray):
        sha.update(f"{value.dtype}{value.shape};".encode())
        sha.update(np.ascontiguousarray(value).data)
        return
    for name, part in parts_of(value):
        sha.update(f"{name}=".encode())
        _walk(part, facts, sha, seen)


def parts_of(value: Any) -> list[tuple[Any, Any]]:
    """The named parts of a container or an object, in an order that does not depend on chance."""
    if isinstance(value, Mapping):
        return list(value.items())
    if isinstance(value, list | tuple | deque):
        return list(enumerate(value))
    if isinstance(value, set | frozenset):
        return list(enumerate(sorted(value)))
    if is_dataclass(value):
        return [(f.name, getattr(value, f.name)) for f in fields(value)]
    if hasattr(value, "__dict__"):
        return sorted(vars(value).items())
    raise TypeError(f"the state of a {type(value).__name__} cannot be read")
