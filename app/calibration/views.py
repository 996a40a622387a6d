"""From frames to views: where the arm rested, the mean of what a sensor reported; else a frame.

At rest many frames of one view are averaged, and the stamps do not matter; what time they are off
by shows in single frames of a moving arm.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.calibration.recording import Recording
from app.errors import SensorError
from app.messages import Array
from app.perception.cloud import corrected
from app.robot.skin import Skin

SPAN = 0.1  # [s] over which a speed is measured: encoders are noisy
AT_REST = 0.01  # [rad/s] or [m/s]
SHORTEST = 0.3  # [s] of a rest
LATEST = 0.2  # [s] that stamps may be late: so long after a rest begins its frames count
FAST = 0.15  # [rad/s] of the fastest joint: a frame of a moving arm
MOVING = 30  # such frames of each sensor, evenly taken: enough for the time
FEWEST = 3  # good reports of a zone in a rest
STRAY = 0.02, 4.0  # [m] and standard deviations from the median: a report that is no part of it


@dataclass(frozen=True, eq=False, slots=True)
class Views:
    """V views of Z zones.

    sensor: (V,).   stamp: (V,) [s] as the source said.   moving: (V,) bool.
    q:      (V, n) where the arm rested; NaN of a moving one.
    report: (V, Z) [m] as the zones report it, known range errors taken off; NaN: nothing good.
    frames: (V, Z) reports that its mean is of.
    """

    sensor: NDArray[np.intp]
    stamp: Array
    moving: NDArray[np.bool_]
    q: Array
    report: Array
    frames: Array

    def of(self, use: NDArray[np.bool_]) -> "Views":
        """Some of them (V,)."""
        return Views(*(getattr(self, name)[use] for name in Views.__slots__))


@dataclass(frozen=True, eq=False, slots=True)
class Path:
    """Where the arm was: q (J, n) at stamp (J,), linear in between."""

    stamp: Array
    q: Array

    def at(self, t: Array) -> Array:
        """q (m, n) at t (m,) [s]."""
        return np.stack([np.interp(t, self.stamp, column) for column in self.q.T], axis=1)

    def speed(self, t: Array) -> Array:
        """(m, n) [rad/s] at t (m,)."""
        return (self.at(t + SPAN / 2) - self.at(t - SPAN / 2)) / SPAN


def path_of(recording: Recording) -> Path:
    """The arm's motion in a recording."""
    return Path(recording.joint_stamp, recording.q)


def views_of(recording: Recording, skin: Skin) -> Views:
    """All views of a recording; SensorError where the arm never rested before a sensor."""
    path, report = path_of(recording), _believed(recording, skin)
    parts = [_resting(recording, report, skin, path, *rest) for rest in _rests(path)]
    if not any(len(v.sensor) for v in parts):
        raise SensorError(
            "the recorded arm never rests while its sensors speak; let it stand for a second in "
            "many postures, as flinch calibrate mounts does"
        )
    parts.append(_moving(recording, report, path))
    joined = [np.concatenate([getattr(p, name) for p in parts]) for name in Views.__slots__]
    return Views(*joined)


def _believed(r: Recording, skin: Skin) -> Array:
    """(F, Z) reports that are trusted, with the errors taken off that are known already."""
    out = np.full(r.distance.shape, np.nan)
    for k in range(skin.count):
        mine, slots = r.sensor == k, np.arange(skin.slots)[skin.zones(k)]
        n = len(slots)
        raw = r.distance[mine, :n].astype(np.float64)
        fixed = corrected(skin, np.tile(slots, len(raw)), raw.ravel()).reshape(raw.shape)
        good = np.isfinite(skin.believed(k, raw, r.status[mine, :n], r.targets[mine, :n]))
        least, most = skin.sensors[k].type.least_m, skin.sensors[k].type.most_m
        good &= (raw > least) & (raw < most)
        out[mine, :n] = np.where(good, fixed, np.nan)
    return out


def _rests(path: Path) -> list[tuple[float, float]]:
    """Begin and end [s] of each rest of the arm."""
    still = np.abs(path.speed(path.stamp)).max(axis=1) < AT_REST
    edges = np.flatnonzero(np.diff(np.concatenate(([0], still.astype(np.int8), [0]))))
    spans = [(path.stamp[a], path.stamp[b - 1]) for a, b in edges.reshape(-1, 2)]
    return [(a, b) for a, b in spans if b - a >= SHORTEST]


def _resting(
    r: Recording, report: Array, skin: Skin, path: Path, begin: float, end: float
) -> Views:
    """The means of one rest, a view of each sensor that spoke."""
    inside = (r.stamp >= begin + LATEST) & (r.stamp <= end)
    sensors = np.unique(r.sensor[inside]).astype(np.intp)
    stood = (path.stamp >= begin + SPAN / 2) & (path.stamp <= end - SPAN / 2)
    q = path.q[stood].mean(axis=0) if stood.any() else path.at(np.array([end]))[0]
    Z = report.shape[1]
    mean, count = np.full((len(sensors), Z), np.nan), np.zeros((len(sensors), Z))
    for i, k in enumerate(sensors):
        mine = report[inside & (r.sensor == k)]
        seen = np.isfinite(mine).sum(axis=0) >= FEWEST
        if not seen.any():
            continue
        mine = mine[:, seen]
        middle = np.nanmedian(mine, axis=0)
        floor, sigmas = STRAY
        off = np.abs(mine - middle) > np.maximum(floor, sigmas * skin.sensors[k].type.noise(middle))
        mine = np.where(off, np.nan, mine)
        good = np.isfinite(mine)
        count[i, seen] = good.sum(axis=0)
        mean[i, seen] = np.where(good, mine, 0.0).sum(axis=0) / np.maximum(count[i, seen], 1)
        mean[i, count[i] < FEWEST] = np.nan
    m = len(sensors)
    stamp = np.full(m, (begin + end) / 2)
    return Views(sensors, stamp, np.zeros(m, dtype=bool), np.tile(q, (m, 1)), mean, count)


def _moving(r: Recording, report: Array, path: Path) -> Views:
    """Single frames of the arm on its way, well inside the recorded time."""
    fast = np.abs(path.speed(r.stamp)).max(axis=1) > FAST
    first, last = path.stamp[0] + LATEST, path.stamp[-1]
    fast &= (r.stamp > first) & (r.stamp < last)
    chosen = []
    for k in np.unique(r.sensor):
        mine = np.flatnonzero(fast & (r.sensor == k))
        if len(mine) > MOVING:
            mine = mine[np.linspace(0, len(mine) - 1, MOVING).astype(np.intp)]
        chosen.append(mine)
    i = np.concatenate(chosen) if chosen else np.empty(0, dtype=np.intp)
    seen = report[i]
    return Views(
        r.sensor[i].astype(np.intp), r.stamp[i], np.ones(len(i), dtype=bool),
        np.full((len(i), path.q.shape[1]), np.nan), seen, np.isfinite(seen).astype(np.float64),
    )  # fmt: skip
