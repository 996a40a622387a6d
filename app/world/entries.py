"""The entries of a scene's file as what they stand for, one function for each kind of table."""

from pathlib import Path

import numpy as np

from app.cell.parts import Box, HalfSpace
from app.errors import WorldError
from app.messages import freeze
from app.poses import pose, transform
from app.world.build import MIDDLE
from app.world.motion import motion_of, route_of
from app.world.person import PAUSE, Plan, varied
from app.world.shapes import shape_of
from app.world.tables import BodyTable, CropTable, PersonTable, PlaneTable
from app.world.world import Body

NOWHERE = [np.nan] * 3


def body_of(table: BodyTable, folder: Path, where: str) -> tuple[Body, Box | None]:
    """A body, and the cell's box around it where it is static."""
    for key in ("movable", "motion"):
        if table.static and getattr(table, key):
            raise WorldError(f"{where}: {key} and static exclude each other; leave one out")
    T = pose(table.position_m, table.rpy_deg)
    shape = shape_of(table.shape, folder, where)
    movable = not table.static if table.movable is None else table.movable
    colour = (int(table.colour[1:3], 16), int(table.colour[3:5], 16), int(table.colour[5:7], 16))
    motion = motion_of(table.motion, T, where)
    body = Body(table.name, shape, colour, motion, movable, table.reflectance)
    if not table.static:
        return body, None
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    T_base_box = T @ transform((low + high) / 2, np.zeros(3))
    return body, Box(body.name, freeze(T_base_box), freeze(high - low + 2 * table.margin_m))


def plan_of(table: PersonTable, seed: int, where: str) -> Plan:
    """A person's plan; the entry's own seed and `seed` vary it together."""
    for i, stop in enumerate(table.stops, start=1):
        if stop.reach_m is not None and stop.dwell_s < PAUSE:
            raise WorldError(
                f"{where}: stop {i}: dwell_s = {stop.dwell_s:g}; give {PAUSE:g} s or more to reach"
            )
    points = [np.array([*stop.at_m, 0.0]) for stop in table.stops]
    dwell = [stop.dwell_s for stop in table.stops]
    reach = [NOWHERE if stop.reach_m is None else stop.reach_m for stop in table.stops]
    route = route_of(points, dwell, table.speed_mps, table.loop, where)
    if table.order == "varied" and (table.seed is None or not table.loop):
        raise WorldError(f"{where}: order = 'varied' is drawn and goes on; give a seed and loop")
    plan = Plan(
        table.name, route, freeze(np.array(reach)), int(table.hand == "right"),
        stature=table.stature_m or MIDDLE,
    )  # fmt: skip
    if table.seed is None:
        return plan
    rng = np.random.default_rng([table.seed, seed])
    return varied(plan, rng, table.stature_m is None, table.order == "varied")


def crop_of(table: CropTable) -> Box:
    """A box of its own, for what the scene does not show as a body."""
    return Box(table.name, pose(table.position_m, table.rpy_deg), freeze(np.array(table.size_m)))


def plane_of(table: PlaneTable) -> HalfSpace:
    """A plane: all that lies below it, against its own z axis, is known and static."""
    T = pose(table.position_m, table.rpy_deg)
    return HalfSpace(table.name, T, freeze(np.array(table.size_m)))
