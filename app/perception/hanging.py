"""Hoses and cables: what hangs on the arm, and nobody has modelled.

A hose lies on its link or spans a hollow of it, so all of it is in the link's convex hull, or
hardly outside, and it is thin. A thing of the world that comes there is wide or reaches farther: a
hand has an arm, a plate its other end. So the kept zones of a frame are gathered into things,
neighbours in the image at about one distance, and a thin one of which no part lies outside the
hulls is taken for the robot's, unless it is seen through a hole in something nearer: a hose runs
on, or has its link beside it. A point p that is seen along u at the distance d lies inside if for
the planes (n, o) of all faces

    n . p + o <= THICK + eps + d aside |n x u|

since a zone may look aside, but its range is known to eps.

Links that are fixed to the sensor are left out: their hoses would be in its view for ever, and
whatever else comes near the lens is near them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.returns import Judgement
from app.perception.things import ALIKE, find_in_holes, grow
from app.perception.uncertainty import views_aside
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

KEPT, SELF = int(Verdict.KEPT), int(Verdict.SELF)
THICK = 0.014  # [m] a hose on top of a link: a finger's
WIDE = 0.07  # [m] what is so wide both ways, as the zones see it, is no hose


class Wraps(NamedTuple):
    """What is constant of K sensors and L links.

    first: (K + 1,) zones.   grid: (K, 2).   width: (K,) [rad] of a zone, its smaller one.
    aside: (K,) [rad] how far a zone may look aside.
    plane: (N, 4) n and o of the faces of the links' hulls, link frame; those of link i begin at
            face[i], (L + 1,).
    link, origin: (K,) and (K, 3) [m] of the lenses.
    moves: (K, L) does the link move for the sensor?
    """

    first: NDArray[np.int64]
    grid: NDArray[np.int64]
    width: Array
    aside: Array
    plane: Array
    face: NDArray[np.int64]
    link: NDArray[np.int64]
    origin: Array
    moves: NDArray[np.bool_]


class Hanging:
    """Finds what hangs on the links of a robot."""

    def __init__(self, robot: Robot, skin: Skin) -> None:
        used = [b.vertices[np.unique(b.faces)] for b in robot.bodies]
        planes = [_faces(v) for v in used]
        self._wraps = Wraps(
            first=skin.first,
            grid=skin.grid,
            width=np.array([min(s.type.pitch) for s in skin.sensors]),
            aside=views_aside(skin),
            plane=np.concatenate(planes),
            face=np.append(0, np.cumsum([len(p) for p in planes])).astype(np.int64),
            link=skin.link.astype(np.int64),
            origin=skin.origin,
            moves=~robot.welded[skin.link],
        )

    def mark(
        self,
        sensors: NDArray[np.intp],
        distance: Array,
        points: Array,
        posture: Posture,
        judged: Judgement,
    ) -> None:
        """Turn KEPT into SELF where a thing hangs on the robot; distance (S,), points (S, 3) [m]
        of the zones, base frame."""
        _mark(sensors, distance, points, posture.T_base_link, self._wraps, judged)

    def behind(
        self,
        sensors: NDArray[np.intp],
        asked: NDArray[np.bool_],
        points: Array,
        posture: Posture,
        farthest: float,
        out: NDArray[np.int16],
    ) -> None:
        """Write to `out` (S,), where it is -1, on which link hangs what the `asked` zones (S,) of
        `sensors` (m,) may see behind their `points` (S, 3), up to `farthest` [m]."""
        part = (0.0, farthest)
        _mark_along(sensors, asked, points, posture.T_base_link, self._wraps, part, out)

    def before(
        self,
        sensors: NDArray[np.intp],
        asked: NDArray[np.bool_],
        points: Array,
        posture: Posture,
        back: float,
        out: NDArray[np.int16],
    ) -> None:
        """Write to `out` (S,), where it is -1, which link, or what hangs on it, the `asked` zones
        (S,) of `sensors` (m,) may look past before their `points` (S, 3), by at most `back` [m]."""
        part = (back, 0.0)
        _mark_along(sensors, asked, points, posture.T_base_link, self._wraps, part, out)


def _faces(vertices: Array) -> Array:
    """(N, 4) planes n . p + o = 0 of the convex hull of points (V, 3), n outwards; those that are
    one plane but for a degree and a millimetre come once."""
    planes = np.asarray(ConvexHull(vertices).equations)
    _, first = np.unique(np.round(planes / [0.02, 0.02, 0.02, 0.001]), axis=0, return_index=True)
    return planes[first]


@compiled
def _mark(
    sensors: NDArray[np.intp],
    distance: Array,
    points: Array,
    T_base_link: Array,
    wraps: Wraps,
    judged: Judgement,
) -> None:
    """See `Hanging.mark`."""
    for k in sensors:
        begin, end = wraps.first[k], wraps.first[k + 1]
        link = np.full(end - begin, -1, dtype=np.int16)
        near, lens, T = 0, np.empty(3), T_base_link[wraps.link[k]]
        for a in range(3):
            o = wraps.origin[k]
            lens[a] = T[a, 3] + T[a, 0] * o[0] + T[a, 1] * o[1] + T[a, 2] * o[2]
        for i in range(end - begin):
            zone = begin + i
            if judged.verdict[zone] == KEPT:
                aside = wraps.aside[k] * distance[zone]
                margin = judged.eps[zone] + THICK
                link[i] = _holds(
                    points[zone], lens, margin, aside, wraps.moves[k], T_base_link, wraps
                )
                near += link[i] >= 0
        if near == 0:
            continue
        z, verdict = distance[begin:end], judged.verdict[begin:end]
        outside = _things_outside(link, z, verdict, wraps.grid[k], wraps.width[k])
        for i in range(end - begin):
            if link[i] >= 0 and not outside[i]:
                judged.verdict[begin + i], judged.link[begin + i] = SELF, link[i]


@compiled
def _holds(
    point: Array,
    lens: Array,
    margin: float,
    aside: float,
    moves: NDArray[np.bool_],
    T_base_link: Array,
    wraps: Wraps,
) -> int:
    """The link that `moves` (L,) and whose hull holds a point (3,) that is seen from a lens (3,),
    base frame; -1 if none does.   margin, aside: [m] along the ray and across."""
    p, u = np.empty(3), np.empty(3)
    for link in range(len(T_base_link)):
        if not moves[link]:
            continue
        T, square = T_base_link[link], 0.0
        for a in range(3):
            p[a] = u[a] = 0.0
            for b in range(3):
                p[a] += T[b, a] * (point[b] - T[b, 3])
                u[a] += T[b, a] * (point[b] - lens[b])
            square += u[a] * u[a]
        inside = True
        for i in range(wraps.face[link], wraps.face[link + 1]):
            n, height, along = wraps.plane[i], wraps.plane[i, 3], 0.0
            for a in range(3):
                height += n[a] * p[a]
                along += n[a] * u[a]
            beyond = height - margin
            if beyond > 0.0:
                across = np.sqrt(max(1.0 - along * along / max(square, 1e-12), 0.0))
                if beyond > aside * across:
                    inside = False
                    break
        if inside:
            return link
    return -1


@compiled
def _mark_along(
    sensors: NDArray[np.intp],
    asked: NDArray[np.bool_],
    points: Array,
    T_base_link: Array,
    wraps: Wraps,
    part: tuple[float, float],
    out: NDArray[np.int16],
) -> None:
    """Write through which link's wrap a `part` of each ray passes, as `_passes` has it."""
    lens = np.empty(3)
    for k in sensors:
        T = T_base_link[wraps.link[k]]
        for a in range(3):
            o = wraps.origin[k]
            lens[a] = T[a, 3] + T[a, 0] * o[0] + T[a, 1] * o[1] + T[a, 2] * o[2]
        for zone in range(wraps.first[k], wraps.first[k + 1]):
            if not asked[zone] or out[zone] >= 0:
                continue
            for link in range(len(T_base_link)):
                if wraps.moves[k, link] and _passes(
                    points[zone], lens, wraps.aside[k], part, T_base_link[link],
                    wraps.plane[wraps.face[link] : wraps.face[link + 1]],
                ):  # fmt: skip
                    out[zone] = link
                    break


@compiled
def _passes(
    point: Array, lens: Array, aside: float, part: tuple[float, float], T: Array, plane: Array
) -> bool:  # fmt: skip
    """Does a `part` of the ray from a lens (3,) through a point (3,) pass, `aside` [rad] or less,
    through what may hang on the link at T (4, 4) with the hull `plane` (N, 4)? It begins part[0]
    before the point and ends at part[1] from the lens, or at the point if that is farther [m]."""
    p, u, square = np.empty(3), np.empty(3), 0.0
    for a in range(3):
        p[a] = u[a] = 0.0
        for b in range(3):
            p[a] += T[b, a] * (lens[b] - T[b, 3])
            u[a] += T[b, a] * (point[b] - lens[b])
        square += u[a] * u[a]
    length = max(np.sqrt(square), 1e-6)
    # in lengths of the ray to the point
    low, high = max(1.0 - part[0] / length, 0.0), max(1.0, part[1] / length)
    for i in range(len(plane)):
        height, slope = plane[i, 3] - THICK, -aside * length
        for a in range(3):
            height += plane[i, a] * p[a]
            slope += plane[i, a] * u[a]
        if slope > 0.0:
            high = min(high, -height / slope)
        elif slope < 0.0:
            low = max(low, -height / slope)
        elif height > 0.0:
            return False
        if low > high:
            return False
    return True


@compiled
def _things_outside(
    link: NDArray[np.int16],
    z: Array,
    verdict: NDArray[np.uint8],
    grid: NDArray[np.int64],
    width: float,
) -> NDArray[np.bool_]:
    """(n,) is the kept zone part of a thing that is wide, reaches outside or is seen through a hole
    in something nearer?

    width: [rad] of a zone.
    """
    outside, kept = np.zeros(len(link), dtype=np.bool_), verdict == KEPT
    for i in range(len(link)):
        if kept[i]:
            outside[i] = link[i] < 0 or _wide(i, z, verdict, grid, width)
    grow(outside, z, kept, grid)
    if (kept & ~outside).any():
        find_in_holes(z, kept, grid, outside)
    return outside


@compiled
def _wide(
    zone: int, z: Array, verdict: NDArray[np.uint8], grid: NDArray[np.int64], width: float
) -> bool:
    """Is the thing in a zone `WIDE` both ways around it, as far as the image goes?"""
    row, column = zone // grid[1], zone % grid[1]
    half = int(np.ceil((WIDE / max(width * z[zone], 1e-3) - 1.0) / 2.0))
    for r in range(max(0, row - half), min(grid[0], row + half + 1)):
        for c in range(max(0, column - half), min(grid[1], column + half + 1)):
            j = r * grid[1] + c
            if verdict[j] != KEPT or abs(z[j] - z[zone]) >= ALIKE:
                return False
    return True
