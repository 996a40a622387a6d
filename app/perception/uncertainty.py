"""How far a zone's point may be from where it is said to be: errors propagated to one distance.

A zone of a sensor on link l reports a point p = o + r u, u its direction. To first order, with all
errors independent, the variance of p along a unit direction n is

    (n . u)^2 (noise(r)^2 + (share r)^2)       of its range: noise, and the zone's constant error
    + position^2 + angle^2 |(p - o) x n|^2     of the sensor's mounting
    + time^2 (J . qd)^2                        of the frame's stamp: J . qd is the speed of p with l
    + joint^2 |J - J'|^2                       of the joints between the sensor and what p is near

with J and J' (n,) the speed along n of p as a point of l, and of the body's nearest point as one of
its own link: what moves both alike moves nothing between them. `app.robot.doubt.Doubt` holds the
standard deviations.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Pairs
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.robot.traits import noise_of

# [rad] of a joint's frame against the nominal one: about what UR's own calibration files differ
# by; unlike the encoders' noise a constant of the arm
FRAME_ANGLE = 9e-4


class Known(NamedTuple):
    """How well K sensors and their S zones are known, for kernels.

    sensor_of: (S,) of each zone.   link: (K,).   origin: (K, 3) lens [m], link frame.
    noise: (K, 2), see `app.robot.traits.Traits`.
    position, angle, share, time: (K,), see `app.robot.doubt.Doubt`.
    joint: (1,) [rad] encoders and frames together.
    """

    sensor_of: NDArray[np.int64]
    link: NDArray[np.int64]
    origin: Array
    noise: Array
    position: Array
    angle: Array
    share: Array
    time: Array
    joint: Array


def known_of(skin: Skin) -> Known:
    """What a skin says of itself."""
    d = skin.doubt
    return Known(
        sensor_of=skin.sensor_of.astype(np.int64), link=skin.link.astype(np.int64),
        origin=skin.origin, noise=skin.traits.noise, position=d.position, angle=d.angle,
        share=d.share, time=d.time, joint=np.array([np.hypot(d.joint, FRAME_ANGLE)]),
    )  # fmt: skip


def pair_sigmas(known: Known, pairs: Pairs, posture: Posture, qd: Array) -> Array:
    """(B,) [m] one standard deviation of the distance of each pair that a zone of the cloud
    measured; NaN of the others.

    posture, qd: (n,) [rad/s] where the arm is and how it moves. How far the world has moved since
    the frame is none of this.
    """
    out = np.full(len(pairs.slot), np.nan)
    rows = np.flatnonzero((pairs.slot >= 0) & (pairs.slot < len(known.sensor_of)))
    if not len(rows):
        return out
    sensors = known.sensor_of[pairs.slot[rows]]
    points, normals = pairs.on_world[rows], pairs.normal[rows]
    J = posture.distance_rows(known.link[sensors], points, normals)
    between = J - posture.distance_rows(pairs.link[rows], pairs.on_robot[rows], normals)
    variance = np.empty(len(rows))
    _add_up(sensors, points, normals, J @ qd, between, posture.T_base_link, known, variance)
    out[rows] = np.sqrt(variance)
    return out


@compiled
def _add_up(
    sensors: NDArray[np.int64],
    points: Array,
    normals: Array,
    speed: Array,
    between: Array,
    T_base_link: Array,
    known: Known,
    out: Array,
) -> None:
    """Write the variances (m,) [m^2] of `points` (m, 3) along `normals` (m, 3), base frame.

    sensors: (m,) that saw them.   speed: (m,) J . qd [m/s].   between: (m, n) J - J'.
    """
    for i in range(len(sensors)):
        k = sensors[i]
        T, n = T_base_link[known.link[k]], normals[i]
        square, along = 0.0, 0.0
        for a in range(3):
            o = known.origin[k]
            v = points[i, a] - (T[a, 3] + T[a, 0] * o[0] + T[a, 1] * o[1] + T[a, 2] * o[2])
            square += v * v
            along += v * n[a]
        r = np.sqrt(square)
        ranges = range_variance(known.noise[k, 0], known.noise[k, 1], known.share[k], r)
        across = max(square - along * along, 0.0)  # |(p - o) x n|^2
        lever = 0.0
        for j in range(between.shape[1]):
            lever += between[i, j] * between[i, j]
        out[i] = (
            ranges * along * along / max(square, 1e-12)
            + known.position[k] ** 2 + known.angle[k] ** 2 * across
            + (known.time[k] * speed[i]) ** 2 + known.joint[0] ** 2 * lever
        )  # fmt: skip


@compiled
def range_variance(floor: float, noise_share: float, share: float, distance: float) -> float:
    """[m^2] of a reported distance [m]: noise, and the zone's constant error."""
    return noise_of(floor, noise_share, distance) ** 2 + (share * distance) ** 2
