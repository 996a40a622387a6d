"""How far from a patch an object that comes straight to it is first seen, by each sensor.

The object is a sphere of radius r; its middle comes to the patch x along a line, c(t) = x + t u,
and its gap is t - r. A zone sees it where the sphere touches the zone's pyramid nearer than
where the zone's view ends. The line is first clipped to the sensor's whole pyramid, its faces
moved out by r; what is left is walked from its far end in steps of `STEP`, and the step in which
it is first seen is halved. So most of the pairs of lines and sensors cost a few comparisons.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.coverage.cones import COLUMNS, EDGES, MARGIN, PITCH, RADIAL, REACH, ROWS, SIZE
from app.messages import Array

STEP = 0.02  # [m]
HALVES = 5
GRAZING = 3e-3  # [m] before the end of a line, where the sphere would only just touch

Point = tuple[float, float, float]
Line = tuple[Point, Point]  # a point of it and its direction


@compiled
def first_seen(
    point: Array,
    direction: Array,
    barred: NDArray[np.bool_],
    T_base_sensor: Array,
    eyes: Array,
    radius: float,
    far: float,
) -> NDArray[np.float32]:
    """(K, P, M) [m] the largest gap, `far` at most, at which a sensor sees what comes to a patch
    from a direction; 0 where it never does.

    point: (P, 3), direction: (P, M, 3) unit, base frame.   barred: (P, M) are left at 0.
    eyes:  (K, E) see `app.coverage.cones.packed`.
    """
    out = np.zeros((len(T_base_sensor), len(point), direction.shape[1]), dtype=np.float32)
    for k in range(len(T_base_sensor)):
        T, eye = T_base_sensor[k], eyes[k]
        for p in range(len(point)):
            a, b, c = point[p, 0] - T[0, 3], point[p, 1] - T[1, 3], point[p, 2] - T[2, 3]
            x = (
                T[0, 0] * a + T[1, 0] * b + T[2, 0] * c,
                T[0, 1] * a + T[1, 1] * b + T[2, 1] * c,
                T[0, 2] * a + T[1, 2] * b + T[2, 2] * c,
            )
            for m in range(direction.shape[1]):
                if barred[p, m]:
                    continue
                a, b, c = direction[p, m, 0], direction[p, m, 1], direction[p, m, 2]
                u = (
                    T[0, 0] * a + T[1, 0] * b + T[2, 0] * c,
                    T[0, 1] * a + T[1, 1] * b + T[2, 1] * c,
                    T[0, 2] * a + T[1, 2] * b + T[2, 2] * c,
                )
                low, high = _clipped((x, u), eye, radius, far)
                if low <= high:
                    out[k, p, m] = max(_walk((x, u), low, high, eye, radius) - radius, 0.0)
    return out


@compiled
def _clipped(line: Line, eye: Array, radius: float, far: float) -> tuple[float, float]:
    """The part of a line, from t to t, on which the sphere may touch the pyramid of a sensor."""
    x, u = line
    rows = EDGES + int(eye[SIZE]) + 1
    low, high = _below(-x[2], -u[2], radius, radius, far + radius)
    low, high = _below(x[2], u[2], eye[REACH] + radius, low, high)
    if low > high:
        return low, high
    left, _ = _inner(eye, EDGES)
    _, right = _inner(eye, EDGES + int(eye[COLUMNS]) - 1)
    low, high = _beside(x[0], x[2], u[0], u[2], left, right, (low, high, radius))
    if low > high:
        return low, high
    left, _ = _inner(eye, rows)
    _, right = _inner(eye, rows + int(eye[ROWS]) - 1)
    return _beside(x[1], x[2], u[1], u[2], left, right, (low, high, radius))


@compiled
def _beside(
    x: float, z: float, ux: float, uz: float, left: float, right: float, part: Point
) -> tuple[float, float]:
    """What of a part (low, high, radius) is between two faces with these tangents, moved out."""
    low, high, radius = part
    most = radius * np.sqrt(1.0 + left * left)
    low, high = _below(left * z - x, left * uz - ux, most, low, high)
    most = radius * np.sqrt(1.0 + right * right)
    return _below(x - right * z, ux - right * uz, most, low, high)


@compiled
def _below(a: float, b: float, most: float, low: float, high: float) -> tuple[float, float]:
    """The part of [low, high] where a + b t <= most."""
    if abs(b) < 1e-12:
        return (low, high) if a <= most else (1.0, 0.0)
    t = (most - a) / b
    return (low, min(high, t)) if b > 0.0 else (max(low, t), high)


@compiled
def _walk(line: Line, low: float, high: float, eye: Array, radius: float) -> float:
    """The largest t at which a sensor sees the sphere, to STEP / 2^HALVES; 0 where it never
    does."""
    t, before = max(high - GRAZING, low), high
    while True:
        if _sees(line, t, eye, radius):
            if before == high:  # it is seen from where it can be
                return t
            for _ in range(HALVES):
                middle = 0.5 * (t + before)
                if _sees(line, middle, eye, radius):
                    t = middle
                else:
                    before = middle
            return t
        if t <= low:
            return 0.0
        before, t = t, max(t - STEP, low)


@compiled
def _sees(line: Line, t: float, eye: Array, radius: float) -> bool:
    """Does a zone of a sensor see the sphere with its middle at x + t u, sensor frame?"""
    x, u = line
    c = (x[0] + t * u[0], x[1] + t * u[1], x[2] + t * u[2])
    z = max(c[2], 1e-9)
    tangent = c[0] / z, c[1] / z
    columns, rows = int(eye[COLUMNS]), int(eye[ROWS])
    column = _place(eye, EDGES, columns, tangent[0])
    row = _place(eye, EDGES + int(eye[SIZE]) + 1, rows, tangent[1])
    if _zone_sees(column, row, c, tangent, eye, radius):
        return True  # mostly
    distance = np.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2] + 1e-18)
    more = int(np.arcsin(min(1.0, radius / distance)) / eye[PITCH]) + 1
    for i in range(max(column - more, 0), min(column + more + 1, columns)):
        for j in range(max(row - more, 0), min(row + more + 1, rows)):
            if _zone_sees(i, j, c, tangent, eye, radius):
                return True
    return False


@compiled
def _zone_sees(
    i: int, j: int, c: Point, tangent: tuple[float, float], eye: Array, radius: float
) -> bool:
    """Does the zone at column i and row j see the sphere with its middle at c, at a tangent?"""
    n = int(eye[SIZE])
    left, right = _inner(eye, EDGES + i)
    upper, lower = _inner(eye, EDGES + n + 1 + j)
    # the zone's direction that is nearest to the middle, about
    tx, ty = min(max(tangent[0], left), right), min(max(tangent[1], upper), lower)
    scale = tx * tx + ty * ty + 1.0
    along = c[0] * tx + c[1] * ty + c[2]
    beyond = c[0] * c[0] + c[1] * c[1] + c[2] * c[2] - radius * radius
    inside = along * along - beyond * scale
    if inside < 0.0 or (along < 0.0 and beyond > 0.0):
        return False
    near = max(along - np.sqrt(inside), 0.0) / scale  # depth
    if eye[RADIAL] > 0.0:
        near *= np.sqrt(scale)
    return bool(near < eye[EDGES + 2 * (n + 1) + i * n + j])


@compiled
def _inner(eye: Array, at: int) -> tuple[float, float]:
    """The tangents between which a zone counts, whose edges are at `at` and behind it."""
    margin = eye[MARGIN] * (eye[at + 1] - eye[at])
    return eye[at] + margin, eye[at + 1] - margin


@compiled
def _place(eye: Array, first: int, count: int, tangent: float) -> int:
    """Which of `count` places a tangent lies in, their edges from `first` on; the nearest if in
    none."""
    i = 0
    while i < count - 1 and tangent > eye[first + i + 1]:
        i += 1
    return i
