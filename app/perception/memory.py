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
from app.perception.voxels import MOVING, STATIC, UNDECIDED, carve, decay, empty, insert
from app.perception.voxels import mark_moving as _mark
from app.robot.posture import Posture
from app.robot.skin import FIELD_OF_VIEW, Skin, range_noise

CAPACITY = 20_000  # voxels; the oldest make room
MARGIN, SIGMAS = 0.08, 3.0  # [m] and multiples of the noise that a ray stops short of its depth
WITHOUT_ECHO = 0.5  # [m] that a zone without a target is taken to be free
FAR = 10.0  # [m] farther than any range
WORLD = (Verdict.KEPT, Verdict.STATIC)
ROBOT = (Verdict.SELF, Verdict.BEHIND)
RECENT = 0.3  # [s] what moves is marked if it was seen within


class Memory:
    """Points of the world in the base frame that need not be in sight."""

    def __init__(self, skin: Skin) -> None:
        self._skin = skin
        self._size = [s.resolution for s in skin.sensors]
        self._turn = [_turn(s.rotation_deg, s.mirrored) for s in skin.sensors]
        self._life = np.empty(3)
        self._life[[MOVING, UNDECIDED, STATIC]] = 0.7, 3.0, 30.0
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._voxels = empty(CAPACITY)

    @property
    def points(self) -> Array:
        """(n, 3) [m] base frame; a voxel keeps its row while it lives. Not all are in `use`."""
        return self._voxels.point[: self._voxels.top[0]]

    @property
    def use(self) -> NDArray[np.bool_]:
        """(n,) the rows of `points` that are confirmed."""
        return self._voxels.confirmed[: self._voxels.top[0]]

    def update(self, cloud: Cloud, sensors: NDArray[np.intp], posture: Posture) -> None:
        """Take in the newest frames of `sensors` (m,), which were measured at `posture`."""
        for k in sensors.tolist():
            now = float(cloud.stamp[k])
            slots = slice(k * SLOTS, (k + 1) * SLOTS)
            points, verdict = cloud.points[slots], cloud.verdict[slots]
            insert(self._voxels, points, verdict == Verdict.KEPT, now)
            T_sensor_base = _inverse(
                posture.T_base_link[self._skin.link[k]] @ self._skin.sensors[k].T_link_sensor
            )
            clear, weak = _clear(points, verdict, cloud.gap[slots], T_sensor_base, self._size[k])
            carve(
                self._voxels, now, T_sensor_base, self._size[k], FIELD_OF_VIEW / self._size[k],
                self._turn[k], clear, weak,
            )  # fmt: skip

    def age(self, now: float) -> None:
        """Let die what is too old at `now` [s]."""
        decay(self._voxels, now, self._life)

    def mark_moving(self, centre: Array, now: float) -> None:
        """What was just seen around `centre` (3,) [m] is known to move."""
        _mark(self._voxels, centre, now - RECENT)

    def visited(self, rows: NDArray[np.intp]) -> None:
        """The arm's body has been at these rows of `points`; at the third time they die."""
        self._voxels.inside[rows] += 1


def _clear(
    points: Array, verdict: NDArray[np.uint8], gap: Array, T_sensor_base: Array, size: int
) -> tuple[Array, NDArray[np.bool_]]:
    """(64,) [m] depth up to which each zone is free, and (64,) whether it had no echo."""
    n = size * size
    with np.errstate(invalid="ignore"):
        depth = (points @ T_sensor_base[2, :3] + T_sensor_base[2, 3])[:n]
        to_body = np.minimum(depth, depth + gap[:n])
    v = verdict[:n]
    world = (v == WORLD[0]) | (v == WORLD[1])
    robot = (v == ROBOT[0]) | (v == ROBOT[1])
    echo = np.where(world, depth, np.where(robot, to_body, np.inf))
    # the nearest of a zone and its eight neighbours: zones at an edge see both sides of it
    grid = np.full((size + 2, size + 2), np.inf)
    grid[1:-1, 1:-1] = echo.reshape(size, size)
    rows = np.minimum(np.minimum(grid[:-2], grid[1:-1]), grid[2:])
    nearest = np.minimum(np.minimum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:]).ravel()
    silent = v == Verdict.NO_TARGET
    says = world | robot | silent
    nearest = np.minimum(nearest, np.where(silent, WITHOUT_ECHO, FAR))
    clear = np.zeros(SLOTS)
    clear[:n] = np.where(says, nearest - np.maximum(MARGIN, SIGMAS * range_noise(nearest)), 0.0)
    weak = np.zeros(SLOTS, dtype=bool)
    weak[:n] = silent
    return clear, weak


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
