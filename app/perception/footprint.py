"""The rays that stand for a zone: a cone as wide as its mounting leaves in doubt.

A zone is no line but a cone, and the sensor may point a little aside. So rays are spread over the
zone from rim to rim, and beyond by the error of pointing; a direction of unit depth is

    c + s (a r + b d)       c: the zone's middle, r, d: from there to its rim to the right and down

with s the spread and (a, b) in a square of half width 1: a grid of n x n for a first look, n the
`footprint` of the sensor's type, and the points halfway between them for a second one.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.perception.uncertainty import WIDEST
from app.robot.skin import Sensor, Skin, zone_directions


class Fan(NamedTuple):
    """Where K sensors and their S zones look, in the frames of their links, with R rays a zone.

    first:  (K + 1,) zones of each sensor.   link: (K,).   origin: (K, 3) [m].   axis: (K, 3) unit.
    cone:   (K,) [rad] half angle round the axis of all rays at their widest.
    radial: (K,) does it report the length of a ray, rather than its depth along the axis?
    centre, across, down: (S, 3) c, r and d as above.
    depth:  (S,) depth along the axis per distance that is reported in the zone's middle.
    offset: (K, R, 2) a and b; the middle comes first, then the rest of the first look.
    looks:  (K, 2) rays of the first look, and of both.
    width:  (K,) farthest of a zone's rays from its middle, per depth, at a spread of one.
    """

    first: NDArray[np.int64]
    link: NDArray[np.int64]
    origin: Array
    axis: Array
    cone: Array
    radial: NDArray[np.bool_]
    centre: Array
    across: Array
    down: Array
    depth: Array
    offset: Array
    looks: NDArray[np.int64]
    width: Array


def fan_of(skin: Skin) -> Fan:
    """The fan of a skin; margins are rounded up, so that rounding never culls."""
    parts = [_zones(s) for s in skin.sensors]
    centre, across, down = (np.concatenate(p) for p in zip(*parts, strict=True))
    patterns = [pattern(s.type.footprint) for s in skin.sensors]
    offset = np.zeros((skin.count, max(len(p) for p in patterns), 2))
    for k, p in enumerate(patterns):
        offset[k, : len(p)] = p
    farthest = np.hypot(np.linalg.norm(across, axis=1), np.linalg.norm(down, axis=1))
    cosine = np.einsum("sc,sc->s", centre, skin.axis[skin.sensor_of])
    angle = np.arccos((cosine / np.linalg.norm(centre, axis=1)).clip(-1.0, 1.0))
    return Fan(
        first=skin.first, link=skin.link.astype(np.int64), origin=skin.origin, axis=skin.axis,
        cone=_most(angle + np.arctan(WIDEST * farthest), skin),
        radial=np.array([s.type.radial for s in skin.sensors]),
        centre=centre, across=across, down=down, depth=skin.depth, offset=offset,
        looks=np.array([((len(p) ** 0.5 + 1) ** 2 // 4, len(p)) for p in patterns], dtype=np.int64),
        width=np.ceil(200.0 * _most(farthest, skin)) / 200.0,
    )  # fmt: skip


def pattern(footprint: int) -> Array:
    """((2 n - 1)^2, 2) offsets of the rays of a zone, its middle first, then the rest of n x n."""
    if footprint == 1:
        return np.zeros((1, 2))
    steps = np.linspace(-1.0, 1.0, 2 * footprint - 1)
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1)
    first = np.zeros(grid.shape[:2], dtype=bool)
    first[::2, ::2] = True
    early, late = grid[first], grid[~first]
    middle = (early == 0.0).all(axis=1)  # footprints are odd
    return np.concatenate((early[middle], early[~middle], late))


def _zones(sensor: Sensor) -> tuple[Array, Array, Array]:
    """(n, 3) each: middle of the zones, from there to their right and to their lower rims."""
    kind, R = sensor.type, sensor.T_link_sensor[:3, :3]
    row, column = np.divmod(np.arange(kind.zones, dtype=np.float64), kind.columns)
    centre = zone_directions(sensor, row, column)
    across, down = (
        zone_directions(sensor, row + b, column + a) - zone_directions(sensor, row - b, column - a)
        for a, b in ((0.25, 0.0), (0.0, 0.25))  # of the tangents, which differ hardly over a zone
    )  # fmt: skip
    return centre @ R.T, across @ R.T, down @ R.T


def _most(of_zones: Array, skin: Skin) -> Array:
    """(K,) the largest value (S,) of each sensor's zones."""
    return np.asarray(np.maximum.reduceat(of_zones, skin.first[:-1]))
