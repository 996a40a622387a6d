"""What does not fit a table is told in one line, in the same words for every file."""

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import inspect

from app.cell.files import CellTable
from app.control.programs import ProgramTable
from app.errors import ConfigError
from app.robot.skin_file import SkinTable
from app.robot.tables import RobotTable
from app.toml import Name, Positive, Table, Vector, checked
from app.world.tables import SceneTable, ShapeTable

BALL = {"name": "ball", "shape": {"kind": "sphere", "radius_m": 0.1}, "position_m": [1, 0, 0]}
WALK = {"name": "ann", "speed_mps": 1, "stops": [{"at_m": [0, 0]}, {"at_m": [1, 0], "dwell_s": 3}]}
WAY = {"kind": "waypoints", "points_m": [[0, 0, 1]], "speed_mps": 1}
SCENE = {
    "title": "t", "home_deg": [0, 90], "goal": {"position_m": [1, 0, 0.5]}, "person": [WALK],
    "body": [BALL, BALL | {"motion": WAY}],
}  # fmt: skip
ROBOT = {
    "name": "r", "title": "t", "urdf": "r.urdf", "tool_frame": "tool", "home_deg": [0.0],
    "acceleration_limit": [1.0], "eps_m": {"link": 0.01}, "tool": {"name": "t", "body": "t.stl",
    "mass_kg": 1.0, "centre_of_mass_m": [0, 0, 0], "position_m": [0, 0, 0]},
}  # fmt: skip
RING = {"name": "a", "link": "l", "centre_m": [0, 0, 0], "axis": [1, 0, 0], "start": [0, 0, 1],
        "radius_m": 0.1, "count": 3}  # fmt: skip
SKIN = {"title": "t", "ring": [RING]}
CELL = {
    "box": [{"name": "b", "position_m": [0, 0, 0], "size_m": [1, 1, 1]}],
    "learned": {"edge_m": 0.05, "cells": [[1, 2, 3]]},
}
PROGRAM = {
    "title": "t",
    "waypoint": [{"name": "w", "position_m": [0, 0, 0], "rpy_deg": [0, 0, 0]}],
}
TABLES = [
    (SCENE, SceneTable), (ROBOT, RobotTable), (SKIN, SkinTable), (CELL, CellTable),
    (PROGRAM, ProgramTable), (BALL["shape"], ShapeTable),
]  # fmt: skip


class Wheel(Table, frozen=True):
    """A table with one of everything."""

    name: Name
    radius_m: Positive
    centre_m: Vector = (0.0, 0.0, 0.0)
    spokes: int = 8
    braked: bool = False
    limits: dict[str, Positive] | None = None
    tyre: str | Positive | None = None

    def __post_init__(self) -> None:
        if self.spokes == 7:
            raise ValueError("spokes = 7 make a wheel that limps; give another number")


GOOD = {"name": "left", "radius_m": 0.3}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"radius_m": 0}, "radius_m = 0; give a number above zero"),
        ({"radius_m": "0.3"}, "radius_m = '0.3'; give a finite number"),
        ({"radius_m": float("nan")}, "radius_m = nan; give a finite number"),
        ({"radius": 0.3}, "unknown key 'radius'; did you mean 'radius_m'? known: braked, "),
        ({"name": ""}, "name = ''; give a text in quotes"),
        ({"centre_m": [0, 0]}, "centre_m = [0, 0]; give 3 finite numbers"),
        ({"centre_m": [0, 0, float("inf")]}, "centre_m = [0, 0, inf]; give 3 finite numbers"),
        ({"spokes": 8.5}, "spokes = 8.5; give a whole number"),
        ({"spokes": 7}, "spokes = 7 make a wheel that limps; give another number"),
        ({"braked": 1}, "braked = 1; give true or false"),
        ({"limits": {"a": -1}}, "limits = {'a': -1}; give a table of names, each with"),
        ({"limits": 3}, "limits = 3; give a table of names, each with a number above zero"),
        ({"tyre": [3]}, "tyre = [3]; give a text in quotes or a finite number"),
    ],
)  # fmt: skip
def test_each_kind_of_value_has_its_remedy(change: dict[str, object], told: str) -> None:
    with pytest.raises(ConfigError) as e:
        checked(GOOD | change, Wheel, "cart.toml", ConfigError)
    assert str(e.value).startswith(f"cart.toml: {told}")


def test_the_words_of_a_table_itself_follow_its_name() -> None:
    class Cart(Table, frozen=True):
        wheel: tuple[Wheel, ...]

    with pytest.raises(ConfigError, match=r"cart\.toml: wheel 'left': spokes = 7 make a wheel"):
        checked({"wheel": [GOOD | {"spokes": 7}]}, Cart, "cart.toml", ConfigError)


def test_what_fits_is_given_back_with_its_defaults() -> None:
    wheel = checked(GOOD | {"centre_m": [1, 2, 3]}, Wheel, "cart.toml", ConfigError)
    assert wheel == Wheel("left", 0.3, (1.0, 2.0, 3.0))


def kinds(table: type[Table]) -> list[type[Table]]:
    """Every table that there is."""
    return [table, *(kind for sub in table.__subclasses__() for kind in kinds(sub))]


def unions(kind: object) -> list[inspect.UnionType]:
    """The unions among a table's keys."""
    fields = inspect.type_info(kind).fields
    return [f.type for f in fields if isinstance(f.type, inspect.UnionType)]


@pytest.mark.parametrize("table", kinds(Table))
def test_no_key_may_be_a_limited_value_or_a_tuple(table: type[Table]) -> None:
    """msgspec 0.22 forgets which of the two it keeps, and crashes when rubbish is collected."""
    limits = ("gt", "ge", "lt", "le", "multiple_of", "min_length", "max_length", "pattern")
    for union in unions(table):
        limited = [k for k in union.types if any(getattr(k, x, None) is not None for x in limits)]
        tuples = [k for k in union.types if isinstance(k, inspect.TupleType)]
        assert not (limited and tuples), union


def places(raw: object) -> list[tuple[str | int, ...]]:
    """The ways to everything in a table."""
    steps = (
        raw.items() if isinstance(raw, dict) else enumerate(raw) if isinstance(raw, list) else ()
    )
    return [(), *((step, *rest) for step, value in steps for rest in places(value))]


def changed(raw: object, way: tuple[str | int, ...], value: object) -> object:
    """A copy with another value at the end of a way."""
    if not way:
        return value
    if isinstance(raw, dict):
        return raw | {way[0]: changed(raw[way[0]], way[1:], value)}
    assert isinstance(raw, list) and isinstance(way[0], int)
    return [changed(v, way[1:], value) if i == way[0] else v for i, v in enumerate(raw)]


anything = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 99), st.floats(),
    st.sampled_from(["", "x", "sphere"]),
    st.lists(st.integers(0, 3), max_size=4), st.just({}), st.just([{}]), st.just({"kind": "box"}),
    st.just({"kind": 3}), st.just({"name": "n", "more": [1]}),
)  # fmt: skip


@settings(max_examples=400)
@given(st.sampled_from(TABLES), st.data())
def test_whatever_is_wrong_in_a_table_is_one_line(
    case: tuple[object, object], data: st.DataObject
) -> None:
    raw, kind = case
    way = data.draw(st.sampled_from(places(raw)))
    spoilt = changed(raw, way, data.draw(anything))
    try:
        value = checked(spoilt, kind, "file.toml", ConfigError, "it")
    except ConfigError as e:
        assert str(e).startswith("file.toml: ") and "\n" not in str(e)
        assert "; " in str(e)  # the remedy
    else:
        assert msgspec.convert(spoilt, kind) == value
