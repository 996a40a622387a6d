"""What a click in the scene meant: the point, or the sensor, that is nearest to its ray.

A browser cannot pick a point of a cloud, so the ray of the click comes here.
"""

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.robot.skin import Skin

POINT = 0.012  # [rad] off the ray: some seven pixels of a usual window
LENS = 0.02  # [rad] a sensor's cone is as large as that from two metres
TIP = 0.012  # [m] before the lens: the middle of the cone that is drawn
AWAY = 0.3  # cosine of a lens's axis and the ray from which on it looks away


def off_ray(origin: Array, direction: Array, points: Array) -> Array:
    """(n,) [rad] by which points (n, 3) [m] lie off a ray; NaN and what lies behind: inf."""
    way = points - origin
    ahead = way @ (direction / np.linalg.norm(direction))
    aside = np.sqrt(np.maximum((way**2).sum(axis=1) - ahead**2, 0.0))
    out = np.full(len(points), np.inf)
    seen = np.isfinite(ahead) & (ahead > 0.0)
    out[seen] = np.arctan2(aside[seen], ahead[seen])
    return out


def pick_point(
    origin: Array, direction: Array, points: Array, shown: NDArray[np.bool_]
) -> tuple[int, float]:
    """Row of the shown point nearest to the ray and how far off it is [rad]; -1 and inf if none is
    near enough."""
    off = np.where(shown, off_ray(origin, direction, points), np.inf)
    i = int(np.argmin(off)) if len(off) else -1
    return (i, float(off[i])) if i >= 0 and off[i] <= POINT else (-1, np.inf)


def pick_sensor(
    origin: Array, direction: Array, T_base_link: Array, skin: Skin
) -> tuple[int, float]:
    """The sensor whose cone is nearest to the ray and does not look away from the eye, and how far
    off it is [rad]; -1 and inf if none is near enough."""
    T = T_base_link[skin.link]
    axis = np.einsum("kij,kj->ki", T[:, :3, :3], skin.axis)
    tip = T[:, :3, 3] + np.einsum("kij,kj->ki", T[:, :3, :3], skin.origin + TIP * skin.axis)
    off = off_ray(origin, direction, tip)
    off[axis @ (direction / np.linalg.norm(direction)) > AWAY] = np.inf
    k = int(np.argmin(off)) if len(off) else -1
    return (k, float(off[k])) if k >= 0 and off[k] <= LENS else (-1, np.inf)
