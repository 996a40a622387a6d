"""Values out of tables that a person wrote: every complaint names the place, key and remedy.

`where` is the beginning of the message: a file and an entry, such as
`cell.toml: body 'table'`.
"""

import math
from collections.abc import Collection, Mapping
from typing import Any, TypeVar

import numpy as np

from app.errors import WorldError, options
from app.messages import Array, freeze
from app.poses import transform

Table = Mapping[str, Any]
T = TypeVar("T")


def expect_keys(
    table: Table, where: str, required: Collection[str], optional: Collection[str] = ()
) -> None:
    """Complain of the first unknown key, else of the first missing one."""
    for key in table:
        if key not in required and key not in optional:
            raise WorldError(
                f"{where}: unknown key {key!r}; {options(key, [*required, *optional])}"
            )
    for key in required:
        if key not in table:
            raise WorldError(f"{where}: key {key!r} is missing; add it")


def number(
    table: Table, key: str, where: str, default: float | None = None, positive: bool = False
) -> float:
    """A finite number, or `default` where the key is absent."""
    value = table.get(key, default)
    if not _is_number(value):
        raise WorldError(f"{where}: {key} = {value!r}; give a finite number")
    if positive and value <= 0:
        raise WorldError(f"{where}: {key} = {value!r}; give a number above zero")
    return float(value)


def vector(
    table: Table,
    key: str,
    where: str,
    length: int = 3,
    default: tuple[float, ...] | None = None,
    positive: bool = False,
) -> Array:
    """`length` finite numbers, (length,), or `default` where the key is absent."""
    value = table.get(key, default)
    sequence = isinstance(value, list | tuple | np.ndarray)
    if not sequence or len(value) != length or not all(map(_is_number, value)):
        raise WorldError(f"{where}: {key} = {value!r}; give {length} finite numbers")
    if positive and min(value) <= 0:
        raise WorldError(f"{where}: {key} = {value!r}; give numbers above zero")
    return freeze(np.array(value, dtype=np.float64))


def typed(table: Table, key: str, where: str, kind: type[T], default: T) -> T:
    """A value of exactly this kind (bool, int, str, list, dict), or `default` if absent."""
    value = table.get(key, default)
    if type(value) is not kind:
        names = {bool: "true or false", int: "a whole number", str: "a text in quotes"}
        wanted = names.get(kind, "a list in [ ]" if kind is list else "a table in { }")
        raise WorldError(f"{where}: {key} = {value!r}; give {wanted}")
    return value


def pose(table: Table, where: str) -> Array:
    """Pose (4, 4) of the keys `position_m` and `rpy_deg`, both zero where absent."""
    origin = (0.0, 0.0, 0.0)
    rpy = np.radians(vector(table, "rpy_deg", where, default=origin))
    return transform(vector(table, "position_m", where, default=origin), rpy)


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, int | float | np.number)
        and not isinstance(value, bool)
        and math.isfinite(value)
    )
