"""How well each pair's distance is known, and how old it is.

The point of a zone lies r = p - o from its lens. One sigma of where it lies along the pair's
normal n, with c the cosine between r and n, is

    sigma^2 = c^2 (noise(r)^2 + (share r)^2) + position^2 + (1 - c^2) (angle r)^2
              + (time n . v)^2 ,     v: of p as if it rode on the sensor's link

The first is the sensor's own noise, the rest is what is not known of its place, its zones and
its clock (`app.robot.doubt`). A remembered point is the mean of several in its voxel; which
sensors saw it is not kept.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Cloud, JointState, Pairs, freeze
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.robot.traits import noise_of

REMEMBERED = 0.006  # [m] 1 sigma of a remembered point: a zone's bias and its mounting at 0.3 m
SIGMA, AGE = 0, 1  # rows of what is written


class Who(NamedTuple):
    """What is known of K sensors, link frame: link (K,), origin (K, 3) [m], sensor_of (S,), noise
    (K, 2) of `Traits`, doubt (4, K) position [m], angle [rad], share, time [s]."""

    link: NDArray[np.int64]
    origin: Array
    sensor_of: NDArray[np.int64]
    noise: Array
    doubt: Array


class Seen(NamedTuple):
    """Of B pairs: slot (B,), on_world and normal (B, 3); when what was seen [s]: stamp (K,) of the
    sensors' frames, remembered (n,) of the memory's points; and now [s]."""

    slot: NDArray[np.int64]
    on_world: Array
    normal: Array
    stamp: Array
    remembered: Array
    now: float


class Motion(NamedTuple):
    """T_base_link (L, 4, 4), J_base (6, n), supports (L, n), qd (n,) [rad/s]."""

    T_base_link: Array
    J_base: Array
    supports: Array
    qd: Array


def who_of(skin: Skin) -> Who:
    """The skin's."""
    d = skin.doubt
    doubt = np.array([d.position, d.angle, d.share, d.time])
    return Who(skin.link, skin.origin, skin.sensor_of, skin.traits.noise, doubt)


def with_doubt(
    pairs: Pairs, cloud: Cloud, remembered: Array, posture: Posture, joints: JointState, who: Who
) -> Pairs:
    """`pairs` with `sigma` and `age` at `joints`; remembered: (n,) [s] when each of the memory's
    points was seen."""
    seen = Seen(
        pairs.slot, pairs.on_world, pairs.normal, cloud.stamp, remembered, joints.stamp
    )  # fmt: skip
    moves = Motion(posture.T_base_link, posture.J_base, posture.supports, joints.qd)
    out = np.empty((2, len(pairs.slot)))
    _doubt(seen, moves, who, out)
    freeze(out)
    return replace(pairs, sigma=out[SIGMA], age=out[AGE])


@compiled
def _doubt(seen: Seen, moves: Motion, who: Who, out: Array) -> None:
    """Write sigma [m] and age [s] (2, B)."""
    current = len(who.sensor_of)
    for i in range(len(seen.slot)):
        slot = seen.slot[i]
        if slot < 0:
            out[SIGMA, i] = out[AGE, i] = np.inf
        elif slot >= current:
            out[SIGMA, i], out[AGE, i] = REMEMBERED, seen.now - seen.remembered[slot - current]
        else:
            k = who.sensor_of[slot]
            p, n = seen.on_world[i], seen.normal[i]
            variance = _variance(p, n, k, moves.T_base_link[who.link[k]], who)
            ride = who.doubt[3, k] * _speed(p, n, moves, who.link[k])
            out[SIGMA, i], out[AGE, i] = np.sqrt(variance + ride * ride), seen.now - seen.stamp[k]


@compiled
def _variance(p: Array, n: Array, k: int, T: Array, who: Who) -> float:
    """[m^2] along n (3,) of the point p (3,) that sensor k on a link at T (4, 4) has seen."""
    square, along, o = 0.0, 0.0, who.origin[k]
    for a in range(3):
        r = p[a] - T[a, 3] - T[a, 0] * o[0] - T[a, 1] * o[1] - T[a, 2] * o[2]
        square += r * r
        along += r * n[a]
    r, c2 = np.sqrt(square), min(along * along / max(square, 1e-12), 1.0)
    noise = noise_of(who.noise[k, 0], who.noise[k, 1], r)
    position, angle, share = who.doubt[0, k], who.doubt[1, k], who.doubt[2, k]
    own = noise * noise + (share * r) ** 2
    return float(c2 * own + position * position + (1.0 - c2) * (angle * r) ** 2)


@compiled
def _speed(p: Array, n: Array, moves: Motion, link: int) -> float:
    """[m/s] along n (3,) of a point p (3,) that rides on a link: [n, p x n] J_base qd."""
    x, y, z = p[1] * n[2] - p[2] * n[1], p[2] * n[0] - p[0] * n[2], p[0] * n[1] - p[1] * n[0]
    J, speed = moves.J_base, 0.0
    for j in range(len(moves.qd)):
        along = n[0] * J[0, j] + n[1] * J[1, j] + n[2] * J[2, j]
        turn = x * J[3, j] + y * J[4, j] + z * J[5, j]
        speed += moves.supports[link, j] * (along + turn) * moves.qd[j]
    return speed
