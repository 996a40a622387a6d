"""Nearest places of straight segments, for capsules: to each other and to boxes."""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

TURNS = 40  # of the search for the deepest place in a box; each leaves two thirds of the bracket
TOUCHING = 1e-18  # [m^2] a segment this near to a box goes into it


@compiled
def between(a: Array, b: Array, c: Array, d: Array) -> tuple[float, float]:
    """Where segments ab and cd are nearest, as shares of them (Ericson, "Real-Time Collision
    Detection", 5.1.9)."""
    uu, vv, uv, uw, vw = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        u, v, w = b[i] - a[i], d[i] - c[i], a[i] - c[i]
        uu += u * u
        vv += v * v
        uv += u * v
        uw += u * w
        vw += v * w
    tiny = 1e-12
    s = 0.0
    denominator = uu * vv - uv * uv
    if uu > tiny and denominator > tiny:
        s = min(max((uv * vw - uw * vv) / denominator, 0.0), 1.0)
    t = (uv * s + vw) / vv if vv > tiny else 0.0
    if t < 0.0 or t > 1.0 or vv <= tiny:
        t = min(max(t, 0.0), 1.0)
        s = min(max((uv * t - uw) / uu, 0.0), 1.0) if uu > tiny else 0.0
    return s, t


@compiled
def to_box(p: Array, u: Array, half: Array) -> tuple[float, float]:
    """Where p + s u, 0 <= s <= 1, is nearest to a box, and the square of its distance there.

    p, u: (3,) in the frame of the box, whose middle is the origin.   half: (3,) half edges [m].
    The square of the distance is convex in s, and its slope is straight between the places
    where the line crosses the planes of the faces; those leave a stretch where it is straight.
    """
    low, high = 0.0, 1.0
    for i in range(3):
        if u[i] == 0.0:
            continue
        for side in range(-1, 2, 2):
            s = (side * half[i] - p[i]) / u[i]
            if low < s < high:
                if _slope(p, u, half, s) < 0.0:
                    low = s
                else:
                    high = s
    s, one, two = low, _slope(p, u, half, low), _slope(p, u, half, high)
    if one < 0.0:
        s = high if two <= 0.0 else low + (high - low) * one / (one - two)
    square = 0.0
    for i in range(3):
        square += max(abs(p[i] + s * u[i]) - half[i], 0.0) ** 2
    return s, square


@compiled
def _slope(p: Array, u: Array, half: Array, s: float) -> float:
    """Half of the rate at which the square of the distance to the box grows with s."""
    rate = 0.0
    for i in range(3):
        x = p[i] + s * u[i]
        if x > half[i]:
            rate += u[i] * (x - half[i])
        elif x < -half[i]:
            rate += u[i] * (x + half[i])
    return rate


@compiled
def deepest(p: Array, u: Array, half: Array, outer: NDArray[np.bool_]) -> tuple[float, float, int]:
    """Where p + s u, 0 <= s <= 1, is farthest inside a box that it goes into, how far, and the
    face that is nearest there.

    outer: (6,) which faces +x, -x, +y, ... lead out; all do where none does.
    How far a place lies behind the nearest of some planes is concave along a line, so a bracket
    around the most of it may be shortened from both sides.
    """
    low, high = 0.0, 1.0
    for i in range(3):
        if u[i] != 0.0:
            one, two = (-half[i] - p[i]) / u[i], (half[i] - p[i]) / u[i]
            low, high = max(low, min(one, two)), min(high, max(one, two))
    for _ in range(TURNS):
        one, two = low + (high - low) / 3.0, high - (high - low) / 3.0
        if way_out(p, u, half, outer, one)[0] >= way_out(p, u, half, outer, two)[0]:
            high = two
        else:
            low = one
    s = 0.5 * (low + high)
    depth, face = way_out(p, u, half, outer, s)
    return s, depth, face


@compiled
def way_out(
    p: Array, u: Array, half: Array, outer: NDArray[np.bool_], s: float
) -> tuple[float, int]:
    """How far p + s u is behind the nearest outer face of a box, and which that is."""
    buried = True
    for k in range(6):
        buried &= not outer[k]
    least, face = np.inf, 0
    for k in range(6):
        if outer[k] or buried:
            x = p[k // 2] + s * u[k // 2]
            way = half[k // 2] - (x if k % 2 == 0 else -x)
            if way < least:
                least, face = way, k
    return least, face
