"""The zones' views as pyramids on a grid of tangents, in the frames of their sensors."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.robot.skin import Skin, zone_centres


class Cones(NamedTuple):
    """Views of K sensors with S zones; places of a grid are counted along x and y of the sensor.

    T_link_sensor: (K, 4, 4).   link: (K,).
    edge_x, edge_y: (K, n + 1) tangents between which the columns, the rows of zones look.
    shape: (K, 2) columns and rows.   pitch: (K,) [rad] the smaller angle between two zones.
    slot:  (K, n, n) the zone at a column and a row.
    margin: (K,) share of a zone's width at each edge that does not count, see `cones_of`.
    radial: (K,) bool, are distances along the ray?   reach: (K,) [m] how far it is believed.
    """

    T_link_sensor: Array
    link: NDArray[np.int64]
    edge_x: Array
    edge_y: Array
    shape: NDArray[np.int64]
    pitch: Array
    slot: NDArray[np.int64]
    margin: Array
    radial: NDArray[np.bool_]
    reach: Array


def cones_of(skin: Skin, reach: float | None = None) -> Cones:
    """The views of a skin. reach [m]: how far they are counted; without it as far as each type
    finds a grey target in the dark (`SensorType.detection`), never beyond what is believed.

    What reaches into a zone by no more than its edge fills too little of it to be reported: what
    is beyond the outermost of the rays that stand for the zone does not count.
    """
    n = int(skin.grid.max())
    edges = np.zeros((2, skin.count, n + 1))
    shape, pitch = np.empty((skin.count, 2), dtype=np.int64), np.empty(skin.count)
    slot, far = np.full((skin.count, n, n), -1, dtype=np.int64), np.empty(skin.count)
    for k, sensor in enumerate(skin.sensors):
        angle = np.arctan(zone_centres(sensor)[:, :2]).round(9)
        place, steps = np.empty((sensor.type.zones, 2), dtype=np.int64), sensor.type.pitch
        if sensor.rotation_deg % 180 == 0:
            steps = steps[1], steps[0]
        for axis in range(2):
            middle, place[:, axis] = np.unique(angle[:, axis], return_inverse=True)
            shape[k, axis], step = len(middle), steps[axis]
            at = np.append(middle - step / 2.0, middle[-1] + step / 2.0)
            edges[axis, k, : len(at)] = np.tan(at)
        pitch[k] = min(steps)
        slot[k, place[:, 0], place[:, 1]] = skin.first[k] + np.arange(sensor.type.zones)
        grey = sensor.type.detection.grey.dark_m
        far[k] = min(sensor.type.most_m, grey if reach is None else reach)
    return Cones(
        T_link_sensor=np.array([s.T_link_sensor for s in skin.sensors]),
        link=np.array(skin.link, dtype=np.int64),
        edge_x=edges[0],
        edge_y=edges[1],
        shape=shape,
        pitch=pitch,
        slot=slot,
        margin=np.array([0.5 / s.type.footprint for s in skin.sensors]),
        radial=np.array([s.type.radial for s in skin.sensors]),
        reach=far,
    )


def poses_of(cones: Cones, T_base_link: Array) -> Array:
    """T_base_sensor (K, 4, 4) of links posed at T_base_link (L, 4, 4)."""
    return np.ascontiguousarray(T_base_link[cones.link] @ cones.T_link_sensor)


# A kernel that hands arrays on counts each of them twice, so a sensor is one row of numbers:
# these, then the n + 1 edges of its columns and of its rows, then where its zones' views end.
COLUMNS, ROWS, PITCH, RADIAL, REACH, SIZE, MARGIN, EDGES = range(8)


def packed(cones: Cones, free: Array) -> Array:
    """(K, E) one row a sensor, for kernels; free: (S,) see `app.coverage.occlusion.Views`."""
    count, n = cones.slot.shape[:2]
    head = np.empty((count, EDGES))
    head[:, [COLUMNS, ROWS]], head[:, PITCH] = cones.shape, cones.pitch
    head[:, RADIAL], head[:, REACH], head[:, SIZE] = cones.radial, cones.reach, n
    head[:, MARGIN] = cones.margin
    ends = np.where(cones.slot < 0, 0.0, free[cones.slot]).reshape(count, -1)
    return np.hstack((head, cones.edge_x, cones.edge_y, ends))
