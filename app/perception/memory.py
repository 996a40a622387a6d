"""What was seen a moment ago and has left the field of view: a short memory of the world.

The skin sees slices. As the arm gives way, the slice moves off the obstacle, the pair is gone
and the goal pulls the arm back. So kept points stay in a grid of 3 cm voxels in the base
frame, until a ray passes through them, the arm has been there itself, or their time is over:
moving things 0.7 s, undecided ones 3 s, things seen often at one place 30 s. What a carved
voxel was part of has probably left with it, so its undecided neighbourhood counts as moving.

A zone carves up to its own depth and its neighbours' less 8 cm (edges mix depths); one that
saw the robot up to the robot; one without an echo, which dark clothing also gives, up to 0.5 m
and slowly. A zone with a bad status carves nothing.

Current points are always used as they are; a voxel takes part once it is confirmed by a second
hit in or beside it.
"""

import numpy as np
from numpy.typing import NDArray

from app.messages import SLOTS, Array, Cloud, Verdict
from app.perception import voxels as grid
from app.perception.voxels import MOVING, STATIC, UNDECIDED
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import FIELD_OF_VIEW, Skin

CAPACITY = 20_000  # voxels; the oldest make room
RECENT = 0.3  # [s] what moves is marked if it was seen within
REACH = 0.7  # [m] around the links' boxes: a controller looks no farther
PARTS = 8  # ticks in which all voxels are reviewed once


class Memory:
    """Points of the world in the base frame that need not be in sight."""

    def __init__(self, robot: Robot, skin: Skin) -> None:
        self._skin = skin
        self._low = np.array([b.vertices.min(axis=0) for b in robot.bodies])
        self._high = np.array([b.vertices.max(axis=0) for b in robot.bodies])
        self._size = [s.resolution for s in skin.sensors]
        self._turn = [_turn(s.rotation_deg, s.mirrored) for s in skin.sensors]
        self._life = np.empty(3)
        self._life[[MOVING, UNDECIDED, STATIC]] = 0.7, 3.0, 30.0
        self._voxels = grid.empty(CAPACITY)
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

    def update(self, cloud: Cloud, sensors: NDArray[np.intp], posture: Posture) -> None:
        """Take in the newest frames of `sensors` (m,), which were measured at `posture`."""
        for k in sensors.tolist():
            now = float(cloud.stamp[k])
            slots = slice(k * SLOTS, (k + 1) * SLOTS)
            points, verdict = cloud.points[slots], cloud.verdict[slots]
            grid.insert(self._voxels, points, verdict == Verdict.KEPT, now)
            T_sensor_base = _inverse(
                posture.T_base_link[self._skin.link[k]] @ self._skin.sensors[k].T_link_sensor
            )
            clear, weak = np.empty(SLOTS), np.empty(SLOTS, dtype=bool)
            size = self._size[k]
            grid.clear_depths(points, verdict, cloud.gap[slots], T_sensor_base, size, clear, weak)
            grid.carve(
                self._voxels, now, T_sensor_base, size, FIELD_OF_VIEW / size,
                self._turn[k], clear, weak,
            )  # fmt: skip

    def age(self, now: float, posture: Posture) -> None:
        """Let die what is too old at `now` [s]; an eighth of the voxels is looked at each time."""
        step = -(-CAPACITY // PARTS)
        grid.review(
            self._voxels, self._part * step, (self._part + 1) * step, now, self._life,
            posture.T_base_link, self._low, self._high, REACH,
        )  # fmt: skip
        self._part = (self._part + 1) % PARTS

    def mark_moving(self, centre: Array, now: float) -> None:
        """What was just seen around `centre` (3,) [m] is known to move."""
        grid.mark_moving(self._voxels, centre, now - RECENT)

    def hold(self, row: int) -> None:
        """What this row of `points` was part of holds the arm back: it is known to stand still."""
        if self._voxels.kind[row] == UNDECIDED:
            self._voxels.kind[row] = STATIC

    def visited(self, rows: NDArray[np.intp]) -> None:
        """The arm's body has been at these rows of `points`; at the third time they die."""
        self._voxels.inside[rows] += 1


def _turn(rotation_deg: int, mirrored: bool) -> Array:
    """(2, 2) from the sensor's image plane to (column, row) in the order of its zones."""
    angle = np.radians(rotation_deg)
    c, s = np.round(np.cos(angle)), np.round(np.sin(angle))
    side = -1.0 if mirrored else 1.0
    return np.array([[side * c, side * s], [-s, c]])


def _inverse(T: Array) -> Array:
    out = np.eye(4)
    out[:3, :3] = T[:3, :3].T
    out[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return out
