"""What is wrong with a table that a person wrote: the entry, the key, its value and the remedy.

msgspec finds the first thing that does not fit its type and says where; the words are made here
from the types, so that every file complains alike:

    cell.toml: body 'ball': shape sphere: radius_m = -1; give a number above zero
"""

import re
from math import isfinite
from typing import Any, NamedTuple

from msgspec import inspect

from app.errors import options

Step = str | int  # a key, or a place in a list
Path = tuple[Step, ...]
STEP = re.compile(r"\.([^.\[`]+)|\[(\d+|\.\.\.)\]")
FIELD = re.compile(r"Object (contains unknown|missing required) field `(.*)`")
KIND = re.compile("Expected|Invalid|not finite")  # the value is simply not what it should be


class Place(NamedTuple):
    """A place in a table: the entries that lead there, its name, its value and its type."""

    entries: tuple[str, ...]
    name: str
    value: Any
    kind: Any


def parse(message: str) -> tuple[str, Path]:
    """msgspec's complaint, and the way to what it is about as far as that is told."""
    complaint, _, way = message.partition(" - at `")
    path: list[Step] = []
    for key, number in STEP.findall(way):
        if number == "...":
            break  # one of a table with keys of its own: it is not told which
        path.append(key or int(number))
    return complaint, tuple(path)


def explain(complaint: str, path: Path, raw: Any, kind: Any, name: str) -> str:
    """What is wrong at the end of `path` in `raw`, which should be a `kind` and is called `name`.

    complaint: msgspec's, "not finite", or the own words of a table's `__post_init__`.
    """
    place = Place((), name, raw, inspect.type_info(kind))
    for step in path:
        if step == _tag_field(place.kind):
            given = place.value[step]
            known = options(str(given), _tags(place.kind))
            return _line(place.entries, f"unknown {place.name} {step} {given!r}; {known}")
        place = _into(place, step)
    if KIND.match(complaint):
        return _line(place.entries, f"{place.name} {_remedy(place)}")
    found = FIELD.fullmatch(complaint)
    if not found:
        return _line(_inside(place), complaint)
    state, key = found.groups()
    if key == _tag_field(place.kind):
        known = options("", _tags(place.kind))
        return _line(place.entries, f"{place.name} has no {key}; {known}")
    if state == "missing required":
        return _line(_inside(place), f"key {key!r} is missing; add it")
    return _line(_inside(place), f"unknown key {key!r}; {options(key, _fields(place))}")


def _line(entries: tuple[str, ...], words: str) -> str:
    return ": ".join((*entries, words.strip()))


# --- the way to a place -------------------------------------------------------------------


def _into(place: Place, step: Step) -> Place:
    """One step on; a number in a list leads nowhere, since the whole list is shown."""
    if isinstance(step, str):
        kind = _fields(place).get(step, inspect.AnyType())
        return Place(_inside(place), step, place.value[step], kind)
    items, value = _bare(place.kind), place.value[step]
    kind = items.item_types[step] if isinstance(items, inspect.TupleType) else items.item_type
    if _structs(kind):
        return Place(place.entries, _entry(place.name, value, step), value, kind)
    if isinstance(_bare(kind), inspect.TupleType | inspect.VarTupleType | inspect.ListType):
        return Place(place.entries, f"{place.name}[{step}]", value, kind)
    return place


def _inside(place: Place) -> tuple[str, ...]:
    """The entries that lead to the keys of the table at `place`."""
    name = f"{place.name} {_tag(place) or ''}".strip()
    return (*place.entries, name) if name else place.entries


def _entry(key: str, value: Any, index: int) -> str:
    """What an entry of the list `key` is called: by its name, or by its number from 1."""
    name = value.get("name") if isinstance(value, dict) else None
    one = key.removesuffix("s")
    return f"{one} {name!r}" if isinstance(name, str) and name else f"{one} {index + 1}"


# --- kinds of values ----------------------------------------------------------------------


def _bare(kind: Any) -> Any:
    """A kind without what is said of it, and without "or nothing at all"."""
    if isinstance(kind, inspect.Metadata):
        return _bare(kind.type)
    if isinstance(kind, inspect.UnionType):
        some = [k for k in kind.types if not isinstance(k, inspect.NoneType)]
        return _bare(some[0]) if len(some) == 1 else inspect.UnionType(tuple(some))
    return kind


def _structs(kind: Any) -> list[inspect.StructType]:
    bare = _bare(kind)
    kinds = bare.types if isinstance(bare, inspect.UnionType) else (bare,)
    return [k for k in map(_bare, kinds) if isinstance(k, inspect.StructType)]


def _tag_field(kind: Any) -> str | None:
    return next((s.tag_field for s in _structs(kind) if s.tag_field), None)


def _tags(kind: Any) -> list[str]:
    return [str(s.tag) for s in _structs(kind)]


def _tag(place: Place) -> Any:
    """Which of several kinds of table `place` is, None where it is the only one."""
    field = _tag_field(place.kind)
    return place.value.get(field) if field and isinstance(place.value, dict) else None


def _fields(place: Place) -> dict[str, Any]:
    """The keys of the table at `place` with the kinds of their values; its tag's too."""
    structs, field = _structs(place.kind), _tag_field(place.kind)
    chosen = [s for s in structs if len(structs) == 1 or s.tag == _tag(place)]
    fields = {f.encode_name: f.type for s in chosen for f in s.fields}
    return fields | ({field: inspect.StrType()} if field else {})


# --- remedies -----------------------------------------------------------------------------


def _remedy(place: Place) -> str:
    if isinstance(place.value, list) and not place.value:
        return "is empty; give at least one"
    return f"= {place.value!r}; give {_wanted(place.kind, place.value)}"


def _wanted(kind: Any, value: Any) -> str:
    """What to give for a `kind`, for a person who gave `value`."""
    if isinstance(kind, inspect.Metadata) and kind.extra_json_schema:
        return str(kind.extra_json_schema["description"])
    match _bare(kind):
        case inspect.BoolType():
            return "true or false"
        case inspect.StrType():
            return "a text in quotes"
        case inspect.LiteralType(values=values):
            return " or ".join(map(repr, values))
        case inspect.IntType() | inspect.FloatType() as number:
            whole = "a whole number" if isinstance(number, inspect.IntType) else "a finite number"
            return _number_within(number) if _is_a(number, value) else whole
        case inspect.TupleType(item_types=items) if _numeric(items[0]):
            return _numbers(items[0], value, len(items))
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
            many = len(value) if isinstance(value, list | tuple) else 0
            return _numbers(item, value, many) if many and _numeric(item) else "a list in [ ]"
        case inspect.DictType(value_type=item) if _numeric(item):
            return f"a table of names, each with {_number_within(_bare(item))}"
        case inspect.StructType(fields=fields):
            return f"a table with {', '.join(f.encode_name for f in fields if f.required)}"
        case inspect.UnionType(types=types) if not _structs(kind):
            return " or ".join(dict.fromkeys(_wanted(t, value) for t in types))
        case _:
            return "a table in { }"


def _numeric(kind: Any) -> bool:
    return isinstance(_bare(kind), inspect.IntType | inspect.FloatType)


def _is_a(kind: Any, value: Any) -> bool:
    """Is it a number of this kind, whatever its limits?"""
    kinds = int if isinstance(kind, inspect.IntType) else int | float
    return isinstance(value, kinds) and not isinstance(value, bool) and isfinite(value)


def _numbers(item: Any, value: Any, count: int) -> str:
    """`count` numbers of a kind."""
    bare = _bare(item)
    listed = isinstance(value, list | tuple) and len(value) == count
    if listed and all(_is_a(bare, v) for v in value):
        return _number_within(bare).replace("a ", "", 1).replace("number", "numbers")
    return f"{count} {'whole' if isinstance(bare, inspect.IntType) else 'finite'} numbers"


def _number_within(kind: Any) -> str:
    """A number within the limits of its kind, in words."""
    words = "a whole number" if isinstance(kind, inspect.IntType) else "a number"
    if kind.gt == 0:
        words += " above zero"
    limits = {"above": kind.gt or None, "from": kind.ge, "below": kind.lt, "up to": kind.le}
    return words + "".join(f" {side} {v:g}" for side, v in limits.items() if v is not None)
