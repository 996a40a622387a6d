"""Hoses and cables: what hangs on the arm, and nobody has modelled.

A hose lies on its link or spans a hollow of it, so all of it is in the box round the link, or
hardly outside. A thing of the world that comes there reaches farther: a hand has an arm, a plate
its other end. So the kept zones of a frame are gathered into things, neighbours in the image at
about one distance, and a thing of which no part lies outside the boxes is taken for the robot's.

Links that are fixed to the sensor are left out: their hoses would be in its view for ever, and
whatever else comes near the lens is near them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.ghosts import ALIKE
from app.perception.returns import Judgement
from app.perception.uncertainty import views_aside
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

KEPT, SELF = int(Verdict.KEPT), int(Verdict.SELF)
THICK = 0.014  # [m] a hose on top of a link's box: a finger's


class Boxes(NamedTuple):
    """What is constant of K sensors and L links.

    first: (K + 1,) zones.   grid: (K, 2).   aside: (K,) [rad] how far a zone may look aside.
    low, high: (L, 3) [m] corners of the links' boxes, link frame.
    moves: (K, L) does the link move for the sensor?
    """

    first: NDArray[np.int64]
    grid: NDArray[np.int64]
    aside: Array
    low: Array
    high: Array
    moves: NDArray[np.bool_]


class Hanging:
    """Finds what hangs on the links of a robot."""

    def __init__(self, robot: Robot, skin: Skin) -> None:
        used = [b.vertices[np.unique(b.faces)] for b in robot.bodies]
        self._boxes = Boxes(
            first=skin.first,
            grid=skin.grid,
            aside=views_aside(skin),
            low=np.array([v.min(axis=0) for v in used]),
            high=np.array([v.max(axis=0) for v in used]),
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
        _mark(sensors, distance, points, posture.T_base_link, self._boxes, judged)


@compiled
def _mark(
    sensors: NDArray[np.intp],
    distance: Array,
    points: Array,
    T_base_link: Array,
    boxes: Boxes,
    judged: Judgement,
) -> None:
    """See `Hanging.mark`."""
    for k in sensors:
        begin, end = boxes.first[k], boxes.first[k + 1]
        link = np.full(end - begin, -1, dtype=np.int16)
        near = 0
        for i in range(end - begin):
            zone = begin + i
            if judged.verdict[zone] == KEPT:
                margin = judged.eps[zone] + boxes.aside[k] * distance[zone] + THICK
                link[i] = _holds(points[zone], margin, boxes.moves[k], T_base_link, boxes)
                near += link[i] >= 0
        if near == 0:
            continue
        z, verdict = distance[begin:end], judged.verdict[begin:end]
        outside = _things_outside(link, z, verdict, boxes.grid[k])
        for i in range(end - begin):
            if link[i] >= 0 and not outside[i]:
                judged.verdict[begin + i], judged.link[begin + i] = SELF, link[i]


@compiled
def _holds(
    point: Array, margin: float, moves: NDArray[np.bool_], T_base_link: Array, boxes: Boxes
) -> int:
    """The link that moves and whose box, so much larger, holds a point (3,); -1 if none does."""
    for link in range(len(T_base_link)):
        if not moves[link]:
            continue
        T, inside = T_base_link[link], True
        x, y, z = point[0] - T[0, 3], point[1] - T[1, 3], point[2] - T[2, 3]
        for a in range(3):
            u = T[0, a] * x + T[1, a] * y + T[2, a] * z
            inside &= boxes.low[link, a] - margin <= u <= boxes.high[link, a] + margin
        if inside:
            return link
    return -1


@compiled
def _things_outside(
    link: NDArray[np.int16], z: Array, verdict: NDArray[np.uint8], grid: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """(n,) is the kept zone part of a thing that reaches outside? From there inwards."""
    n, columns = len(link), grid[1]
    outside, todo, left = np.zeros(n, dtype=np.bool_), np.empty(n, dtype=np.int64), 0
    for i in range(n):
        if verdict[i] == KEPT and link[i] < 0:
            outside[i], todo[left] = True, i
            left += 1
    while left > 0:
        left -= 1
        i = todo[left]
        row, column = i // columns, i % columns
        for r in range(max(0, row - 1), min(grid[0], row + 2)):
            for c in range(max(0, column - 1), min(columns, column + 2)):
                j = r * columns + c
                if verdict[j] == KEPT and not outside[j] and abs(z[j] - z[i]) < ALIKE:
                    outside[j], todo[left] = True, j
                    left += 1
    return outside
