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
# sigmas along a ray and across it; `flinch experiment frontier` shows what more would cost, and
# what noise carries beyond them for one frame waits for a second (see `app.perception.ghosts`)
SIGMAS, ASIDE = 2.5, 1.5
TOGETHER = 1e-3  # [s] frames that near are judged at one time, half of that off at most
BASE, LEAST = 0.02, 0.03  # [m] the paper's threshold; it gives no figure
WIDEST = 2.5  # half widths of a zone; a lens at its own body would have all around it excused


class Known(NamedTuple):
    """How well K sensors and their S zones are known, for kernels.

    sensor_of: (S,) of each zone.   link: (K,).   origin: (K, 3) lens [m], link frame.
    noise, pulse: (K, 2), see `app.robot.traits.Traits`.
    merge: (K,) [m] how far behind a target another one is told apart.
    near: (K, 2) [m] what is added at the lens, less and less up to where.
    half: (K,) [rad] half of a zone's smaller width.
    position, angle, share, time: (K,), see `app.robot.doubt.Doubt`.
    joint: (1,) [rad] encoders and frames together.
    sigmas: (2,) that are allowed for along a ray and across it.
    """

    sensor_of: NDArray[np.int64]
    link: NDArray[np.int64]
    origin: Array
    noise: Array
    pulse: Array
    merge: Array
    near: Array
    half: Array
    position: Array
    angle: Array
    share: Array
    time: Array
    joint: Array
    sigmas: Array


def known_of(skin: Skin, caution: float = 1.0) -> Known:
    """What a skin says of itself; caution: times the sigmas that are allowed for."""
    d, errors = skin.doubt, [s.type.error for s in skin.sensors]
    return Known(
        sensor_of=skin.sensor_of.astype(np.int64),
        link=skin.link.astype(np.int64),
        origin=skin.origin,
        noise=skin.traits.noise,
        pulse=skin.traits.pulse,
        merge=np.array([s.type.separate_m for s in skin.sensors]),
        near=np.array([(e.near_offset_m, e.near_offset_below_m) for e in errors]),
        half=np.array([min(s.type.pitch) / 2.0 for s in skin.sensors]),
        position=d.position,
        angle=d.angle,
        share=d.share,
        time=np.hypot(d.time, TOGETHER / 2.0),
        joint=np.array([np.hypot(d.joint, FRAME_ANGLE)]),
        sigmas=caution * np.array([SIGMAS, ASIDE]),
    )


def pair_sigmas(known: Known, pairs: Pairs, posture: Posture, qd: Array) -> Array:
    """(B,) [m] one standard deviation of the distance of each pair that a zone of the cloud
    measured; NaN of the others.

    posture, qd: (n,) [rad/s] where the arm is and how it moves. How far the world has moved since
    the frame is none of this.
    """
    out = np.empty(len(pairs.slot))
    ends = Ends(pairs.slot, pairs.link, pairs.on_robot, pairs.on_world, pairs.normal)
    _add_up(ends, Motion(posture.T_base_link, posture.J_base, posture.supports, qd), known, out)
    return out


class Ends(NamedTuple):
    """Of B pairs, as in `Pairs`."""

    slot: NDArray[np.int64]
    link: NDArray[np.int64]
    on_robot: Array
    on_world: Array
    normal: Array


class Motion(NamedTuple):
    """T_base_link (L, 4, 4), J_base (6, n), supports (L, n), qd (n,) [rad/s]."""

    T_base_link: Array
    J_base: Array
    supports: Array
    qd: Array


@compiled
def _add_up(pairs: Ends, moves: Motion, known: Known, out: Array) -> None:
    """Write the deviations (B,) [m] of the points along the pairs' normals, base frame."""
    mine, other = np.empty((2, len(moves.qd)))
    for i in range(len(pairs.slot)):
        if not 0 <= pairs.slot[i] < len(known.sensor_of):
            out[i] = np.nan
            continue
        k, n = known.sensor_of[pairs.slot[i]], pairs.normal[i]
        T, o, p = moves.T_base_link[known.link[k]], known.origin[k], pairs.on_world[i]
        square, along = 0.0, 0.0
        for a in range(3):
            v = p[a] - (T[a, 3] + T[a, 0] * o[0] + T[a, 1] * o[1] + T[a, 2] * o[2])
            square += v * v
            along += v * n[a]
        r = np.sqrt(square)
        ranges = range_variance(known.noise[k, 0], known.noise[k, 1], known.share[k], r)
        across = max(square - along * along, 0.0)  # |(p - o) x n|^2
        _rates(p, n, moves.J_base, moves.supports[known.link[k]], mine)
        _rates(pairs.on_robot[i], n, moves.J_base, moves.supports[pairs.link[i]], other)
        speed, lever = 0.0, 0.0
        for j in range(len(mine)):
            speed += mine[j] * moves.qd[j]
            lever += (mine[j] - other[j]) ** 2
        out[i] = np.sqrt(
            ranges * along * along / max(square, 1e-12)
            + known.position[k] ** 2 + known.angle[k] ** 2 * across
            + (known.time[k] * speed) ** 2 + known.joint[0] ** 2 * lever
        )  # fmt: skip


@compiled
def _rates(p: Array, n: Array, J_base: Array, support: Array, out: Array) -> None:
    """Write the rates (n,) along n (3,) of a point p (3,) of a link: [n, p x n] J_base."""
    x, y, z = p[1] * n[2] - p[2] * n[1], p[2] * n[0] - p[0] * n[2], p[0] * n[1] - p[1] * n[0]
    for j in range(len(out)):
        along = n[0] * J_base[0, j] + n[1] * J_base[1, j] + n[2] * J_base[2, j]
        out[j] = support[j] * (along + x * J_base[3, j] + y * J_base[4, j] + z * J_base[5, j])


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
    return float(near + known.sigmas[0] * np.sqrt(variance))


@compiled
def published_threshold(known: Known, k: int, distance: float) -> float:
    """[m] the same where one ray stands for a zone, as in the paper: a few centimetres."""
    noise = noise_of(known.noise[k, 0], known.noise[k, 1], distance)
    return max(LEAST, BASE + 3.0 * noise)


@compiled
def spread(known: Known, k: int, distance: float, speed: float) -> float:
    """Half widths of a zone from its middle to the farthest part of the body that it may see.

    speed: [m/s] of the body across the ray, as sensor k sees it.
    """
    aside = known.position[k] ** 2 + (known.time[k] * speed) ** 2
    angle = np.sqrt(known.angle[k] ** 2 + aside / max(distance, 0.01) ** 2)
    return float(min(1.0 + known.sigmas[1] * angle / known.half[k], WIDEST))


@compiled
def spreads_of_standing(known: Known, k: int, distance: Array, out: Array) -> None:
    """Write the `spread` (n,) of zones of sensor k that see what stands still at these
    distances (n,) [m]."""
    for i in range(len(distance)):
        out[i] = spread(known, k, distance[i], 0.0)


def views_aside(skin: Skin) -> Array:
    """(K,) [rad] from a zone's middle to the farthest that it may look: half its diagonal, and as
    much as its mounting is in doubt."""
    diagonal = np.array([np.hypot(*s.type.pitch) for s in skin.sensors])
    return np.asarray(diagonal / 2.0 + SIGMAS * skin.doubt.angle)
