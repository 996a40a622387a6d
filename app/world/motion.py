"""Scripted motion: where a body is, as a pure function of time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from app.errors import WorldError, options
from app.messages import Array, freeze
from app.world.route import Route
from app.world.tables import Table, expect_keys, number, typed, vector


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


def make_motion(table: Table | None, T_base_body: Array, where: str) -> Motion:
    """The motion of a scene's table, which begins at the body's own pose; None is still."""
    if table is None:
        return Still(freeze(T_base_body))
    kind = table.get("kind")
    where = f"{where}: motion"
    if not isinstance(kind, str) or kind not in _MAKERS:
        raise WorldError(f"{where}: unknown kind {kind!r}; {options(str(kind), _MAKERS)}")
    return _MAKERS[kind](table, T_base_body, where)


def make_route(
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


def _make_still(table: Table, T_base_body: Array, where: str) -> Motion:
    expect_keys(table, where, ["kind"])
    return Still(freeze(T_base_body))


def _make_line(table: Table, T_base_body: Array, where: str) -> Motion:
    expect_keys(table, where, ["kind", "to_m", "speed_mps"], ["once", "dwell_s"])
    loop = not typed(table, "once", where, bool, False)
    return _along([vector(table, "to_m", where)], table, T_base_body, loop, where)


def _make_waypoints(table: Table, T_base_body: Array, where: str) -> Motion:
    expect_keys(table, where, ["kind", "points_m", "speed_mps"], ["loop", "dwell_s"])
    points = typed(table, "points_m", where, list, [])
    stops = [vector({f"points_m[{i}]": p}, f"points_m[{i}]", where) for i, p in enumerate(points)]
    return _along(stops, table, T_base_body, typed(table, "loop", where, bool, True), where)


def _along(stops: list[Array], table: Table, T_base_body: Array, loop: bool, where: str) -> Along:
    """From the body's own place over the stops."""
    dwell = number(table, "dwell_s", where, 0.0)
    if dwell < 0:
        raise WorldError(f"{where}: dwell_s = {dwell:g}; give zero or more seconds")
    speed = number(table, "speed_mps", where, positive=True)
    stops = [T_base_body[:3, 3], *stops]
    route = make_route(stops, [dwell] * len(stops), speed, loop, where)
    return Along(route, T_base_body[:3, :3])


def _make_circle(table: Table, T_base_body: Array, where: str) -> Motion:
    required = ["kind", "centre_m", "axis", "radius_m", "period_s"]
    expect_keys(table, where, required, ["phase_deg"])
    axis = vector(table, "axis", where)
    if not axis.any():
        raise WorldError(f"{where}: axis = [0, 0, 0]; give a direction")
    return Circle(
        centre=vector(table, "centre_m", where),
        axis=axis / np.linalg.norm(axis),
        radius=number(table, "radius_m", where, positive=True),
        period=number(table, "period_s", where, positive=True),
        phase=float(np.radians(number(table, "phase_deg", where, 0.0))),
        R=T_base_body[:3, :3],
    )


_MAKERS: dict[str, Callable[[Table, Array, str], Motion]] = {
    "still": _make_still,
    "line": _make_line,
    "waypoints": _make_waypoints,
    "circle": _make_circle,
}


def _rigid(R: Array, position: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, position
    return T
