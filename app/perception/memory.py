"""What was seen a moment ago and has left the field of view: a short memory of the world.

The skin sees slices. As the arm gives way, the slice moves off the obstacle, the pair is gone
and the goal pulls the arm back. So kept points stay in a grid of 3 cm voxels in the base
frame, until a ray passes through them, the arm has been there itself, or their time is over:
moving things 0.7 s, things seen often at one place 30 s, undecided ones 3 s from when they were
last seen, if a sensor has looked at their place since, and 30 s if none has: unseen is not gone.
What a carved voxel was part of has probably left with it, so its undecided neighbourhood counts
as moving.

A place that may be the arm's own body is never remembered, since the arm leaves it and no sensor
may look at it again: a point nearer to a link than the self filter's threshold and as
far as the zone may look aside only renews what was seen there before, and so does one that a dirty
window may have made of the body.

A zone carves up to its own depth and its neighbours' less 8 cm (edges mix depths); one that
saw the robot up to the robot; one without an echo, which dark clothing also gives, up to 0.5 m
and slowly. A zone with a bad status carves nothing and has not looked.

Current points are always used as they are; a voxel takes part once it is confirmed by a second
hit in or beside it.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Cloud
from app.perception import voxels as grid
from app.perception.carving import KEPT, Eyes, Seen, carve, what_is_free
from app.perception.uncertainty import views_aside
from app.perception.voxels import MOVING, STATIC, UNDECIDED
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

CAPACITY = 20_000  # voxels; the oldest make room
RECENT = 0.3  # [s] what moves is marked if it was seen within
REACH = 0.7  # [m] around the links' boxes: a controller looks no farther
PARTS = 8  # ticks in which all voxels are reviewed once


class Memory:
    """Points of the world in the base frame that need not be in sight."""

    def __init__(self, robot: Robot, skin: Skin) -> None:
        corners = [(b.vertices.min(axis=0), b.vertices.max(axis=0)) for b in robot.bodies]
        self._eyes = Eyes(
            mount=skin.link.astype(np.int64),
            T_link_sensor=np.array([s.T_link_sensor for s in skin.sensors]),
            first=skin.first,
            grid=skin.grid,
            pitch=np.array([s.type.pitch for s in skin.sensors]),
            turn=np.array([_turn(s.rotation_deg, s.mirrored) for s in skin.sensors]),
            depth=skin.depth,
            box=np.array(corners).swapaxes(0, 1).copy(),
            noise=skin.traits.noise,
            aside=views_aside(skin),
        )
        self._life = np.empty(3)
        self._life[[MOVING, UNDECIDED, STATIC]] = 0.7, 3.0, 30.0
        self._voxels = grid.empty(CAPACITY)
        self._none = np.zeros(skin.slots, dtype=bool)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        if self._voxels.top[0] > 0:
            self._voxels = grid.empty(CAPACITY)
        self._part = 0

    @property
    def points(self) -> Array:
        """(n, 3) [m] base frame; a voxel keeps its row while it lives. Not all are in `use`."""
        return self._voxels.point[: self._voxels.top[0]]

    @property
    def use(self) -> NDArray[np.bool_]:
        """(n,) the rows of `points` that are confirmed."""
        return self._voxels.confirmed[: self._voxels.top[0]]

    @property
    def near(self) -> NDArray[np.bool_]:
        """(n,) those of them that are near the arm."""
        return self.use & self._voxels.near[: self._voxels.top[0]]

    def update(
        self, cloud: Cloud, sensors: NDArray[np.intp], posture: Posture,
        doubted: NDArray[np.bool_] | None = None,
    ) -> None:  # fmt: skip
        """Take in the newest frames of `sensors` (m,), which were measured at `posture`.

        doubted: (S,) zones that see what may be the arm itself for other reasons.
        """
        unsure = self._none if doubted is None else doubted
        _update(
            self._voxels,
            self._eyes,
            sensors,
            posture.T_base_link,
            Seen(cloud.points, cloud.verdict, cloud.gap, cloud.eps, cloud.stamp, unsure),
        )

    def age(self, now: float, posture: Posture) -> None:
        """Let die what is too old at `now` [s]; an eighth of the voxels is looked at each time."""
        step = -(-CAPACITY // PARTS)
        grid.review(
            self._voxels, self._part * step, (self._part + 1) * step, now, self._life,
            posture.T_base_link, self._eyes.box, REACH,
        )  # fmt: skip
        self._part = (self._part + 1) % PARTS

    def mark_moving(self, centres: Array, now: float) -> None:
        """What was just seen around any of `centres` (m, 3) [m] is known to move."""
        if len(centres):
            grid.mark_moving(self._voxels, centres, now - RECENT)

    @property
    def seen(self) -> Array:
        """(n,) [s] when each of `points` was last seen."""
        return self._voxels.seen[: self._voxels.top[0]]

    def visited(self, rows: NDArray[np.intp]) -> None:
        """The arm's body has been at these rows of `points`; at the third time they die."""
        if len(rows):
            self._voxels.inside[rows] += 1


def _turn(rotation_deg: int, mirrored: bool) -> Array:
    """(2, 2) from the sensor's image plane to (column, row) in the order of its zones."""
    angle = np.radians(rotation_deg)
    c, s = np.round(np.cos(angle)), np.round(np.sin(angle))
    side = -1.0 if mirrored else 1.0
    return np.array([[side * c, side * s], [-s, c]])


@compiled
def _update(
    v: grid.Voxels,
    eyes: Eyes,
    sensors: NDArray[np.int64],
    T_base_link: Array,
    seen: Seen,
) -> None:
    """Insert what the newest frames of `sensors` (m,) saw, and carve what they saw through."""
    T_sensor_base = np.eye(4)
    for k in sensors:
        first, last = eyes.first[k], eyes.first[k + 1]
        points = seen.points[first:last]
        A, B = T_base_link[eyes.mount[k]], eyes.T_link_sensor[k]
        for i in range(3):
            T_sensor_base[i, 3] = 0.0
            for j in range(3):
                T_sensor_base[i, j] = A[j, 0] * B[0, i] + A[j, 1] * B[1, i] + A[j, 2] * B[2, i]
                at = A[j, 0] * B[0, 3] + A[j, 1] * B[1, 3] + A[j, 2] * B[2, 3] + A[j, 3]
                T_sensor_base[i, 3] -= T_sensor_base[i, j] * at
        use, sure = seen.verdict[first:last] == KEPT, np.zeros(last - first, dtype=np.bool_)
        for zone in range(last - first):
            if use[zone] and not seen.doubted[first + zone]:
                away = _distance(T_sensor_base, points[zone])
                margin = seen.eps[first + zone] + eyes.aside[k] * away
                sure[zone] = grid.is_apart(points[zone], T_base_link, eyes.box, margin)
        grid.insert(v, points, use, sure, seen.stamp[k])
        sight = what_is_free(k, seen, T_sensor_base, eyes)
        carve(v, k, seen.stamp[k], T_sensor_base, eyes, sight)


@compiled
def _distance(T: Array, point: Array) -> float:
    """[m] of a point (3,) from the origin of the frame that T leads to."""
    square = 0.0
    for i in range(3):
        c = T[i, 0] * point[0] + T[i, 1] * point[1] + T[i, 2] * point[2] + T[i, 3]
        square += c * c
    return float(np.sqrt(square))
