"""The entries of a scene's file as what they stand for, one function for each kind of table."""

from pathlib import Path

import numpy as np

from app.cell.parts import Box, HalfSpace
from app.errors import WorldError, options
from app.messages import freeze
from app.poses import pose, transform
from app.world.build import MIDDLE, SHORT, TALL
from app.world.clip import Clip, clip_bodies
from app.world.motion import motion_of, route_of
from app.world.people import WHO
from app.world.person import PAUSE, Plan, person_bodies, varied
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


def person_of(table: PersonTable, folder: Path, seed: int, where: str) -> list[Body]:
    """The parts of a person, who walks over stops or plays a clip of `folder`.

    The entry's own seed and `seed` vary the person together.
    """
    if not table.clip:
        if table.at_m is not None:
            raise WorldError(f"{where}: at_m belongs to a clip; give a clip or stops")
        return person_bodies(plan_of(table, seed, where))
    if table.stops or table.at_m is None:
        raise WorldError(f"{where}: a clip is played at one place; give at_m and leave stops out")
    return clip_bodies(table.name, clip_of(table, folder, table.at_m, seed))


def person_called(who: str) -> tuple[Body, ...]:
    """The parts of the people whom a name of `WHO` stands for; WorldError for another one."""
    if who not in WHO:
        raise WorldError(f"person = {who!r}; {options(who, WHO)}")
    return tuple(part for table in WHO[who] for part in person_of(table, Path(), 0, "person"))


def clip_of(table: PersonTable, folder: Path, at: tuple[float, float], seed: int) -> Clip:
    """A person's clip, which begins at `at` [m]; a seed draws stature and beginning."""
    stature, start = table.stature_m or MIDDLE, 0.0
    if table.seed is not None:
        rng = np.random.default_rng([table.seed, seed])
        start = float(rng.uniform())
        stature = table.stature_m or float(rng.uniform(SHORT, TALL))
    heading = float(np.radians(table.heading_deg))
    return Clip(folder / table.clip, stature, np.array(at), heading, start)


def plan_of(table: PersonTable, seed: int, where: str) -> Plan:
    """A walking person's plan; the entry's own seed and `seed` vary it together."""
    if not table.stops:
        raise WorldError(f"{where}: there is nowhere to go; give stops or a clip")
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
        stature=table.stature_m or MIDDLE, places=tuple(stop.place for stop in table.stops),
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
