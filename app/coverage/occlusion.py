"""What the arm hides of its own sensors' views, and of what comes to its surface.

A zone reports the nearest thing that any of its rays meets. So where one of them meets the arm,
the zone sees nothing behind that, and its view is free up to the nearest of them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.coverage.cones import Cones
from app.coverage.patches import LIFT, Posed
from app.messages import Array
from app.robot.model import Robot
from app.robot.skin import Skin

HIDDEN = 0.1  # [m] a view that ends nearer than this in most zones is hidden


class Views(NamedTuple):
    """Of S zones at one posture.

    free: (S,) [m] reported distance up to which a zone sees, its sensor's reach at most.
    lost: (S,) share of a zone's cone, by volume, that the arm takes or hides.
    """

    free: Array
    lost: Array


def views_of(robot: Robot, skin: Skin, cones: Cones, T_base_link: Array) -> Views:
    """Cast the rays of all zones at the links posed at T_base_link (L, 4, 4)."""
    T = T_base_link[skin.link[skin.sensor_of]]
    origin = np.einsum("sij,sj->si", T[:, :3, :3], skin.origin[skin.sensor_of]) + T[:, :3, 3]
    way = skin.rays @ T[:, :3, :3].transpose(0, 2, 1)
    rays = way.shape[1]
    length = nearest(robot, T_base_link, np.repeat(origin, rays, axis=0), way.reshape(-1, 3))
    # of other types' longer lists of rays, the last ones only repeat the axis
    mine = np.arange(rays) < skin.ray_count[skin.sensor_of][:, None]
    reported = np.where(mine, length.reshape(-1, rays) * skin.report, np.inf)
    reach = cones.reach[skin.sensor_of]
    kept = (np.minimum(reported, reach[:, None]) / reach[:, None]) ** 3
    return Views(
        np.minimum(reported.min(axis=1), reach), 1.0 - np.mean(kept, axis=1, where=mine)
    )  # fmt: skip


def blocked(robot: Robot, at: Posed, T_base_link: Array, far: float) -> NDArray[np.bool_]:
    """(P, M) bool: does the arm itself stand in the way of what comes to a patch from there,
    within `far` [m]?"""
    ways = at.direction.shape[1]
    start = np.repeat(at.point + LIFT * at.normal, ways, axis=0)
    length = nearest(robot, T_base_link, start, at.direction.reshape(-1, 3))
    return np.asarray((length < far).reshape(-1, ways))


def hidden_sensors(skin: Skin, views: Views) -> NDArray[np.bool_]:
    """(K,) which sensors look into the arm: most of their zones end within `HIDDEN`."""
    near = np.add.reduceat((views.free < HIDDEN).astype(np.int64), skin.first[:-1])
    return np.asarray(near > np.diff(skin.first) / 2)


def nearest(robot: Robot, T_base_link: Array, origin: Array, way: Array) -> Array:
    """(n,) [m] where rays from `origin` along unit `way` (n, 3), base frame, first meet a link;
    +inf where they meet none."""
    length = np.full(len(origin), np.inf)
    for T, mesh in zip(T_base_link, robot.rigid, strict=True):
        ray, at, there = _reaching(origin, way, T, mesh.centre, mesh.radius)
        length[ray] = np.minimum(length[ray], mesh.cast(at, there))
    return length


@compiled
def _reaching(
    origin: Array, way: Array, T_base_link: Array, centre: Array, radius: float
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]:
    """The rays that reach the sphere round a link, and those in its frame: origins, directions.

    centre: (3,), radius [m], of the sphere, link frame.
    """
    T, room = T_base_link, len(origin)
    ray = np.empty(room, dtype=np.int64)
    at, there = np.empty((room, 3), dtype=np.float32), np.empty((room, 3), dtype=np.float32)
    o, d, found = np.empty(3), np.empty(3), 0
    for n in range(room):
        a, b, c = origin[n, 0] - T[0, 3], origin[n, 1] - T[1, 3], origin[n, 2] - T[2, 3]
        along, square = 0.0, 0.0
        for i in range(3):
            o[i] = T[0, i] * a + T[1, i] * b + T[2, i] * c
            d[i] = T[0, i] * way[n, 0] + T[1, i] * way[n, 1] + T[2, i] * way[n, 2]
            to = centre[i] - o[i]
            along += to * d[i]
            square += to * to
        if square - along * along < radius * radius and along > -radius:
            ray[found] = n
            for i in range(3):
                at[found, i], there[found, i] = o[i], d[i]
            found += 1
    return ray[:found], at[:found], there[:found]
