"""The file of a skin's layout: rings and single sensors, read into a `Skin`."""

from math import cos, radians, sin
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from msgspec import Meta

from app.errors import RobotError, options
from app.messages import Array, freeze
from app.robot.sensor_type import DEFAULT, SensorType, load_sensor_type
from app.robot.skin import Sensor, Skin, build_skin
from app.robot.tables import CoverTable
from app.toml import Positive, Table, Vector, read_toml

if TYPE_CHECKING:  # a robot is loaded with the covers of a layout, which needs these tables
    from app.robot.model import Robot


class Mounting(Table, frozen=True):
    """What rings and single sensors have in common.

    link:         body link that carries them; all places and directions are in its frame.
    type:         sensor type, a name or a file beside the layout; empty: the layout's.
    rotation_deg: how far the sensor is turned clockwise in its mounting, as seen from it.
    mirrored:     does the sensor report its columns from the right, as many example programs do?
    """

    link: str
    type: str = ""
    rotation_deg: Literal[0, 90, 180, 270] = 0
    mirrored: bool = False


class RingTable(Mounting, frozen=True, kw_only=True):
    """`[[ring]]`: sensors evenly around an axis, looking outwards.

    name:     the ring's; its sensors are NAME-01, NAME-02, ...
    centre_m: a point on the axis, in the plane of the lenses.
    axis:     direction of the axis; the sensors are counted round it as the fingers of a right
              hand go whose thumb points along it. The upper edges of their images look along it.
    start:    direction from the centre to the first sensor; only what is across the axis counts.
    radius_m: from the axis to the lenses.
    count:    how many sensors there are.
    tilt_deg: how far they look towards the axis' direction, instead of straight outwards.
    cover:    does the layout's `[cover]` go round this ring?
    """

    name: str
    centre_m: Vector
    axis: Vector
    start: Vector
    radius_m: Positive
    count: Annotated[int, Meta(ge=1, le=100)]
    tilt_deg: Annotated[float, Meta(gt=-90, lt=90)] = 0.0
    cover: bool = True


class SensorTable(Mounting, frozen=True, kw_only=True):
    """`[[sensor]]`: one sensor anywhere.

    name:       the sensor's.
    position_m: its lens.
    direction:  where it looks: its optical axis.
    up:         direction of its image's upper edge; need not be exactly across.
    """

    name: str
    position_m: Vector
    direction: Vector
    up: Vector


class SkinTable(Table, frozen=True):
    """A layout: where the sensors of a robot sit.

    title:  what the page calls it.
    type:   sensor type of all that name none of their own.
    ring:   `[[ring]]` tables.
    sensor: `[[sensor]]` tables.
    cover:  the `[cover]` round each ring; none where left out.
    """

    title: str
    type: str = DEFAULT
    ring: tuple[RingTable, ...] = ()
    sensor: tuple[SensorTable, ...] = ()
    cover: CoverTable | None = None


def load_skin(path: Path, robot: "Robot") -> Skin:
    """Read a layout for `robot`; raises `RobotError` naming file, entry, key and remedy."""
    table = read_toml(path, SkinTable, RobotError)
    entries = [*table.ring, *table.sensor]
    kinds = {name: _type_of(name, path) for name in {t.type or table.type for t in entries}}
    sensors = [
        s for i, t in enumerate(table.ring)
        for s in ring_sensors(t, kinds[t.type or table.type], f"{path}: ring[{i}]")
    ]  # fmt: skip
    sensors += [
        _single(t, kinds[t.type or table.type], f"{path}: sensor[{i}]")
        for i, t in enumerate(table.sensor)
    ]
    if not sensors:
        raise RobotError(f"{path}: has no sensor; add a [[ring]] or a [[sensor]]")
    seen: set[str] = set()
    for s in sensors:
        if s.name in seen:
            raise RobotError(f"{path}: sensor name {s.name!r} is used twice; rename one")
        seen.add(s.name)
        if s.link not in robot.links:
            raise RobotError(
                f"{path}: sensor {s.name!r}: link = {s.link!r} is no body link of {robot.name}; "
                f"{options(s.link, robot.links)}"
            )
    return build_skin(table.title, tuple(sensors), robot)


def _type_of(name: str, path: Path) -> SensorType:
    """The type that a layout names, also of a file beside it."""
    try:
        return load_sensor_type(name, path.parent)
    except RobotError as e:
        raise RobotError(f"{path}: type = {name!r}: {e}") from e


def ring_axes(t: RingTable, where: str) -> tuple[Array, Array, Array]:
    """Unit vectors (3,) of a ring: along its axis, to its first sensor, and across both."""
    axis = _unit(t.axis, where, "axis")
    radial = _across(t.start, axis, where, "start")
    return axis, radial, np.cross(axis, radial)


def ring_sensors(t: RingTable, kind: SensorType, where: str) -> list[Sensor]:
    """The sensors of a ring; RobotError that begins with `where` for axes without a direction."""
    axis, radial, side = ring_axes(t, where)
    tilt = radians(t.tilt_deg)
    sensors = []
    for i in range(t.count):
        a = 2.0 * np.pi * i / t.count
        out = cos(a) * radial + sin(a) * side
        z = cos(tilt) * out + sin(tilt) * axis
        down = -(cos(tilt) * axis - sin(tilt) * out)  # image's upper edge towards the axis
        position = np.array(t.centre_m) + t.radius_m * out
        sensors.append(_sensor(f"{t.name}-{i + 1:02d}", t, kind, position, z, down))
    return sensors


def _single(t: SensorTable, kind: SensorType, where: str) -> Sensor:
    z = _unit(t.direction, where, "direction")
    return _sensor(t.name, t, kind, np.array(t.position_m), z, -_across(t.up, z, where, "up"))


def _sensor(
    name: str, t: Mounting, kind: SensorType, position: Array, z: Array, down: Array
) -> Sensor:
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = np.cross(down, z), down, z, position
    return Sensor(name, t.link, freeze(T), kind, t.rotation_deg, t.mirrored)


def _unit(v: Vector, where: str, key: str) -> Array:
    a = np.array(v)
    length = np.linalg.norm(a)
    if not np.isfinite(length) or length < 1e-9:
        raise RobotError(f"{where}: {key} = {list(v)} has no direction; give a non-zero vector")
    return np.asarray(a / length)


def _across(v: Vector, axis: Array, where: str, key: str) -> Array:
    """Unit component of v orthogonal to `axis`."""
    a = _unit(v, where, key)
    a = a - (a @ axis) * axis
    length = np.linalg.norm(a)
    if length < 1e-3:
        raise RobotError(f"{where}: {key} is parallel to the axis; give another direction")
    return a / length
