"""The entries of a scene file, one function for each kind of table."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from app.cell.parts import Box, HalfSpace
from app.errors import WorldError
from app.messages import Array, freeze
from app.poses import transform
from app.world.motion import make_motion, make_route
from app.world.person import PAUSE, Plan, varied
from app.world.shapes import make_shape
from app.world.tables import Table, expect_keys, number, pose, typed, vector
from app.world.world import Body, Colour

MARGIN = 0.03  # m, around a static body
GREY = "#9aa0a6"
NOWHERE = [np.nan] * 3


def entries(table: Table, kind: str, where: str) -> Iterator[tuple[dict[str, Any], str]]:
    """The tables of one kind, each with its place for messages; every one needs a name."""
    seen = set()
    for i, entry in enumerate(typed(table, kind, where, list, []), start=1):
        here = f"{where}: {kind} {i}"
        if not isinstance(entry, dict):
            raise WorldError(f"{here}: is no table; write it as [[{kind}]]")
        if not isinstance(entry.get("name"), str) or not entry["name"]:
            raise WorldError(f"{here}: key 'name' is missing; add a text in quotes")
        name = entry["name"]
        if name in seen:
            raise WorldError(f"{where}: {kind} {name!r} comes twice; rename one")
        seen.add(name)
        yield entry, f"{where}: {kind} {name!r}"


def read_body(table: Table, folder: Path, where: str) -> tuple[Body, Box | None]:
    """A body, and the cell's box around it where it is static."""
    known = ["position_m", "rpy_deg", "colour", "movable", "static", "margin_m", "motion"]
    expect_keys(table, where, ["name", "shape"], known)
    static = typed(table, "static", where, bool, False)
    movable = typed(table, "movable", where, bool, not static)
    for key in ("movable", "motion"):
        if static and table.get(key):
            raise WorldError(f"{where}: {key} and static exclude each other; leave one out")
    T = pose(table, where)
    shape = make_shape(typed(table, "shape", where, dict, {}), folder, where)
    script = typed(table, "motion", where, dict, {}) if "motion" in table else None
    body = Body(table["name"], shape, _colour(table, where), make_motion(script, T, where), movable)
    if not static:
        return body, None
    margin = number(table, "margin_m", where, MARGIN)
    if margin < 0:
        raise WorldError(f"{where}: margin_m = {margin:g}; give zero or more metres")
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    T_base_box = T @ transform((low + high) / 2, np.zeros(3))
    return body, Box(body.name, freeze(T_base_box), freeze(high - low + 2 * margin))


def read_person(table: Table, seed: int, where: str) -> Plan:
    """A person's plan; the entry's own seed and `seed` vary it together."""
    expect_keys(table, where, ["name", "speed_mps", "stops"], ["loop", "hand", "seed"])
    points, dwell, reach = [], [], []
    for i, stop in enumerate(typed(table, "stops", where, list, []), start=1):
        here = f"{where}: stop {i}"
        if not isinstance(stop, dict):
            raise WorldError(f"{here}: {stop!r}; give a table such as {{ at_m = [0.0, 1.0] }}")
        expect_keys(stop, here, ["at_m"], ["dwell_s", "reach_m"])
        points.append(np.append(vector(stop, "at_m", here, length=2), 0.0))
        dwell.append(number(stop, "dwell_s", here, 0.0))
        reach.append(vector(stop, "reach_m", here) if "reach_m" in stop else NOWHERE)
        if dwell[-1] < (least := PAUSE if "reach_m" in stop else 0.0):
            raise WorldError(f"{here}: dwell_s = {dwell[-1]:g}; give {least:g} s or more")
    loop = typed(table, "loop", where, bool, True)
    speed = number(table, "speed_mps", where, positive=True)
    route = make_route(points, dwell, speed, loop, where)
    hand = typed(table, "hand", where, str, "right")
    if hand not in ("left", "right"):
        raise WorldError(f"{where}: hand = {hand!r}; choose 'left' or 'right'")
    plan = Plan(table["name"], route, freeze(np.array(reach)), int(hand == "right"))
    if "seed" not in table:
        return plan
    own = typed(table, "seed", where, int, 0)
    if own < 0:
        raise WorldError(f"{where}: seed = {own}; give zero or a positive whole number")
    return varied(plan, np.random.default_rng([own, seed]))


def read_crop(table: Table, where: str) -> Box:
    """A box of its own, for what the scene does not show as a body."""
    expect_keys(table, where, ["name", "size_m"], ["position_m", "rpy_deg"])
    size = vector(table, "size_m", where, positive=True)
    return Box(table["name"], freeze(pose(table, where)), size)


def read_plane(table: Table, where: str) -> HalfSpace:
    """A plane: all that lies below it, against its own z axis, is known and static."""
    expect_keys(table, where, ["name"], ["position_m", "rpy_deg", "size_m"])
    size = vector(table, "size_m", where, length=2, default=(2.0, 2.0), positive=True)
    return HalfSpace(table["name"], freeze(pose(table, where)), size)


def read_preset(table: Table, folder: Path, where: str) -> dict[str, Any]:
    """A shape's table to be added later; a mesh's file becomes independent of the folder."""
    expect_keys(table, where, ["name", "shape"])
    shape = dict(typed(table, "shape", where, dict, {}))
    make_shape(shape, folder, where)
    if "file" in shape:
        shape["file"] = str((folder / shape["file"]).resolve())
    return shape


def read_angles(table: Table, key: str, where: str) -> Array | None:
    """A list of angles in degrees as (n,) [rad], None where the key is absent."""
    if key not in table:
        return None
    degrees = typed(table, key, where, list, [])
    if not degrees:
        raise WorldError(f"{where}: {key} is empty; give one angle for each joint")
    return freeze(np.radians(vector(table, key, where, length=len(degrees))))


def _colour(table: Table, where: str) -> Colour:
    text = typed(table, "colour", where, str, GREY)
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        raise WorldError(f"{where}: colour = {text!r}; give '#rrggbb'")
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)
