"""Scripted motion: where a body is, as a pure function of time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from app.errors import WorldError
from app.messages import Array, freeze
from app.world.route import Route
from app.world.tables import CircleMotion, LineMotion, MotionTable, WaypointsMotion


class Motion(Protocol):
    """Anything that knows its pose T_base_body (4, 4) at a time [s]."""

    def pose(self, t: float) -> Array: ...


@dataclass(frozen=True, eq=False, slots=True)
class Still:
    """Stays where it is: T_base_body (4, 4)."""

    T_base_body: Array

    def pose(self, t: float) -> Array:
        return self.T_base_body


@dataclass(frozen=True, eq=False, slots=True)
class Along:
    """Follows a route without turning: R (3, 3)."""

    route: Route
    R: Array

    def pose(self, t: float) -> Array:
        return _rigid(self.R, self.route.at(t).position)


@dataclass(frozen=True, eq=False, slots=True)
class Circle:
    """Round `centre` (3,) [m] about the unit `axis` (3,) at `radius` [m], without turning R.

    One round takes `period` [s]; `phase` [rad] is where it begins.
    """

    centre: Array
    axis: Array
    radius: float
    period: float
    phase: float
    R: Array

    def pose(self, t: float) -> Array:
        # the world axis farthest from the circle's own gives a steady first direction
        u = np.cross(self.axis, np.eye(3)[np.argmin(np.abs(self.axis))])
        u /= np.linalg.norm(u)
        a = self.phase + 2 * np.pi * t / self.period
        way = np.cos(a) * u + np.sin(a) * np.cross(self.axis, u)
        return _rigid(self.R, self.centre + self.radius * way)


def motion_of(table: MotionTable | None, T_base_body: Array, where: str) -> Motion:
    """The motion of a scene's table, which begins at the body's own pose; None is still."""
    where = f"{where}: motion"
    match table:
        case LineMotion(to_m=to, once=once):
            return _along([np.array(to)], table, not once, T_base_body, where)
        case WaypointsMotion(points_m=points, loop=loop):
            return _along(list(map(np.array, points)), table, loop, T_base_body, where)
        case CircleMotion():
            return _circle(table, T_base_body[:3, :3], where)
        case _:
            return Still(freeze(T_base_body))


def route_of(
    stops: Sequence[Array], dwell: Sequence[float], speed: float, loop: bool, where: str
) -> Route:
    """A route over `stops` (3,) [m] with the seconds spent at each, checked."""
    points = np.array(stops)
    if len(points) < 2:
        raise WorldError(f"{where}: there is nowhere to go; give another point")
    ways = np.diff(points, axis=0, append=points[:1])
    if not ways[: None if loop else -1].any(axis=1).all():
        raise WorldError(f"{where}: the same point comes twice in a row; leave one out")
    return Route(freeze(points), freeze(np.array(dwell, dtype=np.float64)), speed, loop)


def _along(
    stops: list[Array], table: LineMotion | WaypointsMotion, loop: bool, T_base_body: Array,
    where: str,
) -> Along:  # fmt: skip
    """From the body's own place over the stops."""
    stops = [T_base_body[:3, 3], *stops]
    route = route_of(stops, [table.dwell_s] * len(stops), table.speed_mps, loop, where)
    return Along(route, T_base_body[:3, :3])


def _circle(table: CircleMotion, R: Array, where: str) -> Circle:
    axis = np.array(table.axis)
    if not axis.any():
        raise WorldError(f"{where}: axis = [0, 0, 0]; give a direction")
    return Circle(
        centre=np.array(table.centre_m),
        axis=axis / np.linalg.norm(axis),
        radius=table.radius_m,
        period=table.period_s,
        phase=float(np.radians(table.phase_deg)),
        R=R,
    )


def _rigid(R: Array, position: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, position
    return T
