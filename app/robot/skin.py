"""The skin: which sensors sit where, and where each of their zones looks.

A zone looks along u = [tan a_column, tan a_row, 1] in the sensor frame (x right, y down, z out,
seen from the sensor), a_i as in `app.robot.sensor_type`. What a sensor reports of it, d, is the
depth along the optical axis or the length of the ray, as its type says; the point is

    p = d * u        (perpendicular)        p = d * u / |u|        (radial)

Here alone the two differ: everywhere else a point is its lens plus d times the zone's `reach`.

The maker's order is row-major from the upper left, seen from the sensor. `mirrored` swaps
the columns first (as many example programs print them); `rotation_deg` then turns the image
clockwise, for sensors mounted turned.

Slots: zones of sensor k are rows first[k] to first[k + 1] of every array over the skin's zones.
"""

from dataclasses import dataclass
from math import cos, radians, sin
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from app.errors import RobotError, options
from app.messages import Array, freeze
from app.robot.ranges import RangeTable
from app.robot.sensor_type import DEFAULT, SensorType, load_sensor_type
from app.robot.tables import CoverTable
from app.robot.traits import TRUSTED, Traits, traits_of
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


@dataclass(frozen=True, eq=False, slots=True)
class Sensor:
    """One sensor: T_link_sensor (4, 4), z out along the optical axis, x right, y down."""

    name: str
    link: str
    T_link_sensor: Array
    type: SensorType
    rotation_deg: int
    mirrored: bool


@dataclass(frozen=True, eq=False, slots=True)
class Skin:
    """All sensors of a robot and their zones, in the frames of their links: K sensors, S slots.

    link:   (K,) body link of each sensor.   origin: (K, 3) lens [m].   axis: (K, 3) unit.
    first:  (K + 1,) int64 slots of each sensor, see above.   sensor_of: (S,) sensor of each slot.
    grid:   (K, 2) rows and columns.
    reach:  (S, 3) point = origin + reported distance * reach.
    depth:  (S,) depth along the axis per reported distance: 1, or less of a radial range.
    rays:   (S, R, 3) unit directions that stand for a zone, its centre's first; of sensor k the
            first ray_count[k] (K,) of them, the others look along the axis.
    report: (S, R) reported distance per metre of these rays: the cosine to the axis, or 1.
    cone:   (K,) [rad] half angle of the cone round the axis that holds all rays of a sensor.
    traits: what the sensors' types say, for kernels.
    ranges: what each zone's range is wrong by, where that was measured.
    late:   [s] how much later than its light the stamp of a frame is, where that was measured.
    """

    title: str
    sensors: tuple[Sensor, ...]
    link: np.ndarray
    origin: Array
    axis: Array
    first: NDArray[np.int64]
    sensor_of: NDArray[np.intp]
    grid: NDArray[np.int64]
    reach: Array
    depth: Array
    rays: Array
    ray_count: NDArray[np.int64]
    report: Array
    cone: Array
    traits: Traits
    ranges: RangeTable | None = None
    late: float = 0.0

    @property
    def count(self) -> int:
        """Number of sensors K."""
        return len(self.sensors)

    @property
    def slots(self) -> int:
        """Number of zones S of all of them."""
        return len(self.sensor_of)

    def noise(self, reported: Array) -> Array:
        """(S,) standard deviation [m] of reported distances (S,) [m]."""
        floor, share = self.traits.noise[self.sensor_of].T
        return np.asarray(np.maximum(floor, share * np.abs(reported)))

    def zones(self, k: int) -> slice:
        """The slots of sensor k."""
        return slice(int(self.first[k]), int(self.first[k + 1]))

    def believed(
        self, k: int, distance: Array, status: NDArray[Any], targets: NDArray[Any]
    ) -> Array:
        """Reports (..., n) [m] of sensor k, NaN where it saw nothing or is not to be trusted."""
        good = (targets > 0) & (self.traits.worth[k][status] == TRUSTED)
        return np.where(good, distance, np.nan)

    def index(self, name: str) -> int:
        """Position of a sensor; the error lists the names."""
        names = [s.name for s in self.sensors]
        if name not in names:
            raise RobotError(f"skin {self.title!r} has no sensor {name!r}; {options(name, names)}")
        return names.index(name)


def zone_directions(sensor: Sensor, rows: Array, columns: Array) -> Array:
    """Directions (m, 3) with unit depth, sensor frame, at fractional `rows` and `columns` (m,).

    Integers are zone centres in the order in which the sensor reports; mounting settings are
    applied, so the result is where that zone looks.
    """
    kind = sensor.type
    down, across = kind.pitch
    x = np.tan((columns - (kind.columns - 1) / 2) * across)
    y = np.tan((rows - (kind.rows - 1) / 2) * down)
    if sensor.mirrored:
        x = -x
    turn = radians(sensor.rotation_deg)
    c, s = round(cos(turn)), round(sin(turn))
    return np.stack([c * x - s * y, s * x + c * y, np.ones_like(x)], axis=1)


def zone_centres(sensor: Sensor) -> Array:
    """(n, 3) directions with unit depth of the sensor's zones, sensor frame."""
    row, column = np.divmod(np.arange(sensor.type.zones, dtype=np.float64), sensor.type.columns)
    return zone_directions(sensor, row, column)


def zone_rays(sensor: Sensor) -> Array:
    """(n, footprint^2, 3) directions with unit depth of the rays that stand for each zone, evenly
    over it, row by row, sensor frame."""
    kind, f = sensor.type, sensor.type.footprint
    row, column = np.divmod(np.arange(kind.zones, dtype=np.float64), kind.columns)
    down, across = np.divmod(np.arange(f * f, dtype=np.float64), f)
    rows = row[:, None] + (down - (f - 1) / 2) / f
    columns = column[:, None] + (across - (f - 1) / 2) / f
    return zone_directions(sensor, rows.ravel(), columns.ravel()).reshape(kind.zones, f * f, 3)


def load_skin(path: Path, robot: "Robot") -> Skin:
    """Read a layout for `robot`; raises `RobotError` naming file, entry, key and remedy."""
    table = read_toml(path, SkinTable, RobotError)
    entries = [*table.ring, *table.sensor]
    kinds = {name: _type_of(name, path) for name in {t.type or table.type for t in entries}}
    sensors = [
        s for i, t in enumerate(table.ring)
        for s in _ring(t, kinds[t.type or table.type], f"{path}: ring[{i}]")
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


def build_skin(title: str, sensors: tuple[Sensor, ...], robot: "Robot") -> Skin:
    """Lay the zones of `sensors` out in slots."""
    count = [s.type.zones for s in sensors]
    first = np.append(0, np.cumsum(count)).astype(np.int64)
    axis = np.array([s.T_link_sensor[:3, 2] for s in sensors])
    ray_count = np.array([s.type.footprint**2 for s in sensors], dtype=np.int64)
    reach, depth = np.empty((first[-1], 3)), np.ones(first[-1])
    # rays beyond a sensor's own look along its axis: they are never cast, and NaN is slow
    sensor_of = np.repeat(np.arange(len(sensors)), count)
    rays = np.repeat(axis[sensor_of, None], ray_count.max(), axis=1)
    for k, sensor in enumerate(sensors):
        mine, R = slice(first[k], first[k + 1]), sensor.T_link_sensor[:3, :3]
        centres = zone_centres(sensor)
        reach[mine] = centres @ R.T
        rays[mine, 0] = reach[mine] / np.linalg.norm(reach[mine], axis=1, keepdims=True)
        around = np.delete(zone_rays(sensor), ray_count[k] // 2, axis=1) @ R.T
        rays[mine, 1 : ray_count[k]] = around / np.linalg.norm(around, axis=2, keepdims=True)
        if sensor.type.radial:
            depth[mine] = 1.0 / np.linalg.norm(centres, axis=1)
            reach[mine] = rays[mine, 0]
    cosine = np.einsum("src,sc->sr", rays, axis[sensor_of])
    radial = np.array([s.type.radial for s in sensors])[sensor_of]
    return Skin(
        title=title,
        sensors=sensors,
        link=freeze(np.array([robot.link_index(s.link) for s in sensors], dtype=np.intp)),
        origin=freeze(np.array([s.T_link_sensor[:3, 3] for s in sensors])),
        axis=freeze(axis),
        first=freeze(first),
        sensor_of=freeze(sensor_of),
        grid=freeze(np.array([s.type.grid for s in sensors], dtype=np.int64)),
        reach=freeze(reach),
        depth=freeze(depth),
        rays=freeze(rays),
        ray_count=freeze(ray_count),
        report=freeze(np.where(radial[:, None], 1.0, cosine)),
        cone=freeze(np.arccos(np.minimum.reduceat(cosine.min(axis=1), first[:-1]).clip(max=1.0))),
        traits=traits_of([s.type for s in sensors]),
    )


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


def _ring(t: RingTable, kind: SensorType, where: str) -> list[Sensor]:
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
