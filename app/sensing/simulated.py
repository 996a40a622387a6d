"""Simulated sensors: the only eye of the simulated robot.

A zone integrates over its solid angle, so it is simulated with 3 x 3 sub-rays against the
world AND the robot's own links; the nearest cluster of depths is what it reports, never the
mean. Sensors are staggered over one period and their frames arrive `latency` later.
"""

from collections import deque
from math import floor

import numpy as np
from numpy.typing import NDArray

from app.messages import SLOTS, Array, SensorFrame, freeze
from app.raycast import MISS
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import FIELD_OF_VIEW, Skin, zone_directions
from app.sensing import zones
from app.sensing.error_model import ErrorModel, Reading
from app.sensing.source import Unfailing
from app.sensing.streams import sensor_streams
from app.world.world import World

RATE = 15.0  # [Hz] the fastest for 8x8 (UM3109)
LATENCY = 0.05  # [s] from measurement to the host
FAR = 4.0  # [m] nothing is seen beyond
CONE = np.arctan(np.sqrt(2.0) * np.tan(FIELD_OF_VIEW / 2.0))  # half angle that holds the pyramid
SUB = 9  # sub-rays a zone


class SimulatedSkin(Unfailing):
    """Frames of every sensor of `skin` on `robot` in `world`, seeded."""

    def __init__(
        self,
        robot: Robot,
        skin: Skin,
        world: World,
        seed: int = 0,
        errors: ErrorModel | None = None,
        latency: float = LATENCY,
    ) -> None:
        self.name = "simulated"
        self.connected: NDArray[np.bool_] = np.ones(skin.count, dtype=bool)
        self.muted: set[int] = set()  # sensors that have gone silent, for trying faults
        self._robot, self._skin, self._world = robot, skin, world
        self._errors = errors or ErrorModel()
        self._latency = latency
        self._streams = [sensor_streams(seed, k) for k in range(skin.count)]
        self._rays = [_sub_rays(skin, k) for k in range(skin.count)]
        self._cosine = [r @ axis for r, axis in zip(self._rays, skin.axis, strict=True)]
        self._own = [self._own_hits(k) for k in range(skin.count)]
        self._centre = np.array([m.centre for m in robot.rigid])
        self._radius = np.array([m.radius for m in robot.rigid])
        self._T, self._seen = (
            np.tile(np.eye(4), (len(self._radius), 1, 1)),
            np.zeros(len(self._radius), dtype=bool),
        )
        self._range = [self._errors.range_90(s.resolution) for s in skin.sensors]
        self._bias = [self._errors.bias(streams) for streams in self._streams]
        self._next: Array | None = None
        self._sequence = np.zeros(skin.count, dtype=np.int64)
        self._had_target = np.zeros((skin.count, SLOTS), dtype=bool)
        self._on_the_way: deque[SensorFrame] = deque()

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Measure with the sensors that are due, return the frames that have arrived."""
        period = 1.0 / RATE
        if self._next is None:
            self._next = now + period * np.arange(self._skin.count) / self._skin.count
        for k in np.flatnonzero(self._next <= now + 1e-9):
            # a sensor keeps its rhythm: what a stall has swallowed is not sent in a burst
            self._next[k] += period * (floor((now - self._next[k]) / period + 1e-6) + 1.0)
            if k not in self.muted:
                self._on_the_way.append(self._frame(int(k), now, posture))
        arrived = []
        while self._on_the_way and self._on_the_way[0].stamp + self._latency <= now + 1e-9:
            arrived.append(self._on_the_way.popleft())
        return arrived

    def ended(self) -> str:
        """A simulation never ends by itself."""
        return ""

    def read(self, k: int, posture: Posture) -> Reading:
        """The truth in each zone of sensor k, for the error model and for judging filters."""
        link = int(self._skin.link[k])
        T = posture.T_base_link[link]
        rays, lens = self._rays[k], self._skin.origin[k]
        origin, axis = T[:3, :3] @ lens + T[:3, 3], T[:3, :3] @ self._skin.axis[k]
        lenses = np.empty_like(rays)
        lenses[:] = origin
        own, own_label = self._own[k]
        hit, label = own.copy(), own_label.copy()
        cone = (origin, axis, float(CONE), FAR)
        zones.nearer(self._world.cast(lenses, rays @ T[:3, :3].T, cone), -1, hit, label)
        zones.aim(
            posture.T_base_link, link, self._robot.welded[link], self._centre, self._radius,
            lens, self._skin.axis[k], float(CONE), FAR, self._T, self._seen,
        )  # fmt: skip
        for i in self._seen.nonzero()[0].tolist():
            t = self._robot.rigid[i].cast(*zones.turned(self._T[i], lens, rays))
            zones.nearer(t, i, hit, label)
        out = Reading(
            depth=np.empty(SLOTS),
            merged=np.empty(SLOTS, dtype=bool),
            label=np.empty(SLOTS, dtype=np.int16),
            pure=np.empty(SLOTS, dtype=bool),
        )
        zones.gather(
            hit, label, self._cosine[k], SUB, out.depth, out.merged, out.label, out.pure
        )  # fmt: skip
        return out

    def _frame(self, k: int, now: float, posture: Posture) -> SensorFrame:
        distance, status, targets = self._errors.measure(
            self.read(k, posture), FAR, self._range[k], self._bias[k], self._had_target[k],
            self._sequence[k] == 0, self._streams[k],
        )  # fmt: skip
        self._sequence[k] += 1
        return SensorFrame(
            sensor=k,
            stamp=now,
            sequence=int(self._sequence[k]),
            distance=freeze(distance),
            status=freeze(status),
            targets=freeze(targets),
        )

    def _own_hits(self, k: int) -> tuple[NDArray[np.float32], NDArray[np.int16]]:
        """Hits on the sensor's own link and what is fixed to it never change; cast once."""
        rays = np.ascontiguousarray(self._rays[k], dtype=np.float32)
        origins = np.tile(self._skin.origin[k].astype(np.float32), (len(rays), 1))
        hit, label = np.full(len(rays), MISS), np.full(len(rays), -2, dtype=np.int16)
        for i in np.flatnonzero(self._robot.welded[self._skin.link[k]]):
            t = self._robot.rigid[i].cast(origins, rays)
            zones.nearer(t, i, hit, label)
        return hit, label


def _sub_rays(skin: Skin, k: int) -> Array:
    """(zones * 9, 3) unit directions in the link frame, zone by zone."""
    sensor = skin.sensors[k]
    n = sensor.resolution
    row, column = np.divmod(np.arange(n * n, dtype=np.float64), n)
    step_row, step_column = np.divmod(np.arange(SUB, dtype=np.float64), 3)
    rows = (row[:, None] + (step_row - 1.0) / 3.0).ravel()
    columns = (column[:, None] + (step_column - 1.0) / 3.0).ravel()
    d = zone_directions(sensor, rows, columns) @ sensor.T_link_sensor[:3, :3].T
    return d / np.linalg.norm(d, axis=1, keepdims=True)
