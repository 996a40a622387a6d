"""The skin: which sensors sit where, and where each of their zones looks.

Zone geometry (UM3109; confirmed on recorded frames): the field of view is 45 x 45 degrees,
zone centres lie at a_i = (i - 3.5) * 45/8 degrees (i - 1.5 and 45/4 for 4x4), and the
reported distance d is the depth along the optical axis, so that the point in the sensor
frame (x right, y down, z out, seen from the sensor) is d * [tan a_column, tan a_row, 1].

The maker's order is row-major from the upper left, seen from the sensor. `mirrored` swaps
the columns first (as many example programs print them); `rotation_deg` then turns the image
clockwise, for sensors mounted turned.
"""

from dataclasses import dataclass
from math import cos, radians, sin
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from msgspec import Meta

from app.errors import RobotError, options
from app.messages import SLOTS, Array, freeze
from app.robot.ranges import RangeTable
from app.robot.tables import CoverTable
from app.toml import Table, read_toml

if TYPE_CHECKING:  # a robot is loaded with the covers of a layout, which needs these tables
    from app.robot.model import Robot

FIELD_OF_VIEW = radians(45.0)
NOISE_FLOOR, NOISE_SHARE = 0.7e-3, 6.5e-3  # [m] and share of depth: measured on real frames
AROUND = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0)]  # a zone's centre
SPACING = 1.0 / 3.0  # of a zone's width, between the rays that stand for it
# returns within this of the nearest merge into one target: a slanted surface is one
PULSE, PULSE_SHARE = 0.05, 0.1  # [m], and share of depth

Vector = tuple[float, float, float]
Positive = Annotated[float, Meta(gt=0)]


class Mounting(Table, frozen=True):
    """What rings and single sensors have in common.

    link:         body link that carries them; all places and directions are in its frame.
    resolution:   zones a row, 8 or 4.
    rotation_deg: how far the sensor is turned clockwise in its mounting, as seen from it.
    mirrored:     does the sensor report its columns from the right, as many example programs do?
    """

    link: str
    resolution: Literal[4, 8] = 8
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
    ring:   `[[ring]]` tables.
    sensor: `[[sensor]]` tables.
    cover:  the `[cover]` round each ring; none where left out.
    """

    title: str
    ring: tuple[RingTable, ...] = ()
    sensor: tuple[SensorTable, ...] = ()
    cover: CoverTable | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Sensor:
    """One sensor: T_link_sensor (4, 4), z out along the optical axis, x right, y down."""

    name: str
    link: str
    T_link_sensor: Array
    resolution: int
    rotation_deg: int
    mirrored: bool


@dataclass(frozen=True, eq=False, slots=True)
class Skin:
    """All sensors of a robot, and their zones in fixed slots (S = 64 K), in link frames.

    link:    (K,) body link of each sensor.   origin: (K, 3) lens [m].
    axis:    (K, 3) optical axis.
    reach:   (S, 3) vector a zone's depth is multiplied with: point = origin + depth * reach;
             its length is ray length per depth. NaN in unused slots.
    around:  (S, 8, 3) unit directions around the zone's centre, a third of its width away.
    used:    (S,) bool, slots that have a zone.
    ranges:  what each zone's range is wrong by, where that was measured.
    """

    title: str
    sensors: tuple[Sensor, ...]
    link: np.ndarray
    origin: Array
    axis: Array
    reach: Array
    around: Array
    used: np.ndarray
    ranges: RangeTable | None = None

    @property
    def count(self) -> int:
        """Number of sensors K."""
        return len(self.sensors)

    def index(self, name: str) -> int:
        """Position of a sensor; the error lists the names."""
        names = [s.name for s in self.sensors]
        if name not in names:
            raise RobotError(f"skin {self.title!r} has no sensor {name!r}; {options(name, names)}")
        return names.index(name)


def range_noise(depth: Array) -> Array:
    """Standard deviation [m] of a zone's distance at `depth` [m], the same shape."""
    return np.maximum(NOISE_FLOOR, NOISE_SHARE * np.abs(depth))


def zone_directions(sensor: Sensor, rows: Array, columns: Array) -> Array:
    """Directions (m, 3) with unit depth, sensor frame, at fractional `rows` and `columns` (m,).

    Integers are zone centres in the order in which the sensor reports; mounting settings are
    applied, so the result is where that zone looks.
    """
    n = sensor.resolution
    pitch = FIELD_OF_VIEW / n
    x = np.tan((columns - (n - 1) / 2) * pitch)
    y = np.tan((rows - (n - 1) / 2) * pitch)
    if sensor.mirrored:
        x = -x
    turn = radians(sensor.rotation_deg)
    c, s = round(cos(turn)), round(sin(turn))
    return np.stack([c * x - s * y, s * x + c * y, np.ones_like(x)], axis=1)


def load_skin(path: Path, robot: "Robot") -> Skin:
    """Read a layout for `robot`; raises `RobotError` naming file, entry, key and remedy."""
    table = read_toml(path, SkinTable, RobotError)
    sensors = [s for i, ring in enumerate(table.ring) for s in _ring(ring, f"{path}: ring[{i}]")]
    sensors += [_single(t, f"{path}: sensor[{i}]") for i, t in enumerate(table.sensor)]
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
    """Lay the zones of `sensors` out in fixed slots."""
    K = len(sensors)
    reach = np.full((K, SLOTS, 3), np.nan)
    around = np.full((K, SLOTS, len(AROUND), 3), np.nan)
    for k, sensor in enumerate(sensors):
        R = sensor.T_link_sensor[:3, :3]
        zones = sensor.resolution**2
        row, column = np.divmod(np.arange(zones, dtype=np.float64), sensor.resolution)
        reach[k, :zones] = zone_directions(sensor, row, column) @ R.T
        for i, (dr, dc) in enumerate(AROUND):
            d = zone_directions(sensor, row + dr * SPACING, column + dc * SPACING) @ R.T
            around[k, :zones, i] = d / np.linalg.norm(d, axis=1, keepdims=True)
    return Skin(
        title=title,
        sensors=sensors,
        link=freeze(np.array([robot.link_index(s.link) for s in sensors], dtype=np.intp)),
        origin=freeze(np.array([s.T_link_sensor[:3, 3] for s in sensors])),
        axis=freeze(np.array([s.T_link_sensor[:3, 2] for s in sensors])),
        reach=freeze(reach.reshape(K * SLOTS, 3)),
        around=freeze(around.reshape(K * SLOTS, len(AROUND), 3)),
        used=freeze(np.isfinite(reach[:, :, 0]).ravel()),
    )


def ring_axes(t: RingTable, where: str) -> tuple[Array, Array, Array]:
    """Unit vectors (3,) of a ring: along its axis, to its first sensor, and across both."""
    axis = _unit(t.axis, where, "axis")
    radial = _across(t.start, axis, where, "start")
    return axis, radial, np.cross(axis, radial)


def _ring(t: RingTable, where: str) -> list[Sensor]:
    axis, radial, side = ring_axes(t, where)
    tilt = radians(t.tilt_deg)
    sensors = []
    for i in range(t.count):
        a = 2.0 * np.pi * i / t.count
        out = cos(a) * radial + sin(a) * side
        z = cos(tilt) * out + sin(tilt) * axis
        down = -(cos(tilt) * axis - sin(tilt) * out)  # image's upper edge towards the axis
        position = np.array(t.centre_m) + t.radius_m * out
        sensors.append(_sensor(f"{t.name}-{i + 1:02d}", t, position, z, down))
    return sensors


def _single(t: SensorTable, where: str) -> Sensor:
    z = _unit(t.direction, where, "direction")
    return _sensor(t.name, t, np.array(t.position_m), z, -_across(t.up, z, where, "up"))


def _sensor(name: str, t: Mounting, position: Array, z: Array, down: Array) -> Sensor:
    T = np.eye(4)
    T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = np.cross(down, z), down, z, position
    return Sensor(name, t.link, freeze(T), t.resolution, t.rotation_deg, t.mirrored)


def _unit(v: Vector, where: str, key: str) -> Array:
    a = np.array(v)
    length = np.linalg.norm(a)
    if not np.isfinite(length) or length < 1e-9:
        raise RobotError(f"{where}: {key} = {list(v)} has no direction; give a non-zero vector")
    return a / length


def _across(v: Vector, axis: Array, where: str, key: str) -> Array:
    """Unit component of v orthogonal to `axis`."""
    a = _unit(v, where, key)
    a = a - (a @ axis) * axis
    length = np.linalg.norm(a)
    if length < 1e-3:
        raise RobotError(f"{where}: {key} is parallel to the axis; give another direction")
    return a / length
