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

What the self filter allows for follows from the same errors. Along the ray it is `threshold`;
across it the body may stand aside of where it is believed, so that a zone may see parts of it
that lie `spread` times its half width from its middle.
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
# [m] links against their meshes (1 to 2 mm) and joints' frames against the nominal ones (0.5 mm)
BODY = 2.5e-3
SIGMAS = 3.0  # along a ray: 99.7 % of a normal distribution
ASIDE = 2.0  # sigmas across a ray: `flinch experiment frontier` shows what more would cost
WIDEST = 2.5  # half widths of a zone; a lens at its own body would have all around it excused
CORRECTED = 0.3  # of a zone's constant error is left by a table of ranges


class Known(NamedTuple):
    """How well K sensors and their S zones are known, for kernels.

    sensor_of: (S,) of each zone.   link: (K,).   origin: (K, 3) lens [m], link frame.
    noise, pulse: (K, 2), see `app.robot.traits.Traits`.
    near: (K, 2) [m] what is added at the lens, less and less up to where.
    half: (K,) [rad] half of a zone's smaller width.
    position, angle, share, time: (K,), see `app.robot.doubt.Doubt`.
    joint: (1,) [rad] encoders and frames together.
    """

    sensor_of: NDArray[np.int64]
    link: NDArray[np.int64]
    origin: Array
    noise: Array
    pulse: Array
    near: Array
    half: Array
    position: Array
    angle: Array
    share: Array
    time: Array
    joint: Array


def known_of(skin: Skin) -> Known:
    """What a skin says of itself."""
    d, errors = skin.doubt, [s.type.error for s in skin.sensors]
    left = 1.0 if skin.ranges is None else CORRECTED
    return Known(
        sensor_of=skin.sensor_of.astype(np.int64),
        link=skin.link.astype(np.int64),
        origin=skin.origin,
        noise=skin.traits.noise,
        pulse=skin.traits.pulse,
        near=np.array([(left * e.near_offset_m, e.near_offset_below_m) for e in errors]),
        half=np.array([min(s.type.pitch) / 2.0 for s in skin.sensors]),
        position=d.position,
        angle=d.angle,
        share=left * d.share,
        time=d.time,
        joint=np.array([np.hypot(d.joint, FRAME_ANGLE)]),
    )


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


@compiled
def threshold(known: Known, k: int, distance: float, speed: float) -> float:
    """[m] by which a return of the body may come from nearer or farther than is predicted.

    speed: [m/s] of the body along the ray, as sensor k sees it.
    """
    variance = range_variance(known.noise[k, 0], known.noise[k, 1], known.share[k], distance)
    variance += known.position[k] ** 2 + BODY * BODY + (known.time[k] * speed) ** 2
    near = known.near[k, 0] * min(max(1.0 - distance / known.near[k, 1], 0.0), 1.0)
    return near + SIGMAS * np.sqrt(variance)


@compiled
def spread(known: Known, k: int, distance: float, speed: float) -> float:
    """Half widths of a zone from its middle to the farthest part of the body that it may see.

    speed: [m/s] of the body across the ray, as sensor k sees it.
    """
    aside = known.position[k] ** 2 + BODY * BODY + (known.time[k] * speed) ** 2
    angle = np.sqrt(known.angle[k] ** 2 + aside / max(distance, 0.01) ** 2)
    return min(1.0 + ASIDE * angle / known.half[k], WIDEST)
