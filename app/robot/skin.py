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
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from app.errors import RobotError, options
from app.messages import Array, freeze
from app.robot.doubt import Doubt, as_laid_out
from app.robot.ranges import RangeTable
from app.robot.sensor_type import SensorType
from app.robot.traits import TRUSTED, Traits, traits_of

if TYPE_CHECKING:  # a robot is loaded with the covers of a layout, which needs these tables
    from app.robot.model import Robot


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
    doubt:  how well the sensors' places, ranges and times are known.
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
    doubt: Doubt
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
        doubt=as_laid_out(len(sensors)),
    )
