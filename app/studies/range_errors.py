"""How wrong simulated ranges are, beside what was measured and published of the real sensor.

One sensor looks at a wall, at distances, angles and in shades; what it reports is judged by its
scatter from frame to frame and by the wall's true place, never by the simulation's constants.
Beside it stand recorded frames of a real one, judged in the same way: from the second difference
of three frames, which a steady motion leaves out,

    sigma^2 = var(z_0 - 2 z_1 + z_2) / 6
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.choices import build_robot
from app.messages import Array, freeze
from app.report import Check, Report
from app.robot.model import Robot
from app.robot.sensor_type import DEFAULT, load_sensor_type
from app.robot.skin import Sensor, Skin, build_skin
from app.sensing.budget import HONEST, Budget
from app.sensing.error_model import ErrorModel
from app.sensing.replay import read_recording
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.world.motion import Still
from app.world.shapes import shape_of
from app.world.tables import PanelShape
from app.world.world import Body, World

# [m, m, m] from, to, standard deviation: of VL53L5CX frames beside a motion-capture system, an
# upper bound, since the sensor flew
MEASURED = (
    (0.015, 0.04, 0.0006), (0.1, 0.2, 0.0009), (0.2, 0.4, 0.0031), (0.4, 0.7, 0.0040),
    (0.7, 1.0, 0.0055), (1.5, 2.0, 0.0097), (2.0, 3.0, 0.0148), (3.0, 4.0, 0.0216),
)  # fmt: skip
BELIEVED = (5, 9)  # UM3109: valid, and valid with a merged pulse
SHADES = {"white": 0.88, "grey": 0.17, "dark": 0.05}  # DS13754's targets, and dark cloth
REACH = {  # [m] DS13754: found in 90 % of the frames, inner zones, in the dark and at 5 klux
    ("white", 0.0): 3.5, ("grey", 0.0): 1.3, ("white", 5.0): 1.1, ("grey", 5.0): 0.8,
}  # fmt: skip
ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0)  # [degrees] of a wall
ASLANT = 0.5  # [m] to a wall that is turned
LIKE = (0.4, 2.5)  # times the measured noise that the simulated one may be
INVALID = 0.10  # Caroleo, Albini, Maiolino, "On the characterisation of the VL53L5CX": the share
# of invalid measurements stays below it
INNER = [8 * r + c for r in (3, 4) for c in (3, 4)]


class Seen(NamedTuple):
    """What F frames report, (F, 64): distance [m], NaN where none is believed, and status."""

    distance: Array
    status: NDArray[np.uint8]


def range_errors(
    frames: int = 150, seeds: int = 6, seed: int = 0, data: Path | None = None
) -> Report:
    """`frames` of each wall, of `seeds` sensors; data: a folder of recorded frames."""
    bench = _Bench()
    rows = [
        _distance_row(bench, d, shade, frames, seeds, seed) for shade in SHADES for d in _middles()
    ]
    rows += [_angle_row(bench, angle, frames, seeds, seed) for angle in ANGLES]
    rows += [_reach_row(bench, shade, klux, d, frames, seed) for (shade, klux), d in REACH.items()]
    if data is not None:
        rows += _recorded_rows(sorted(data.glob("**/state_ToF.csv")))
    return Report("range errors", seed, rows, _checks(rows))


def _middles() -> list[float]:
    return [(low + high) / 2.0 for low, high, _ in MEASURED]


class _Bench:
    """A sensor at the end of an arm, and a wall before it."""

    def __init__(self) -> None:
        self.robot: Robot = build_robot(Setup(skin="none"))
        self.posture = self.robot.posture(self.robot.home)
        sensor = Sensor(
            "sensor", self.robot.links[-1], freeze(np.eye(4)), load_sensor_type(DEFAULT), 0, False
        )
        self.skin: Skin = build_skin("one sensor", (sensor,), self.robot)

    def look(
        self, distance: float, reflectance: float, degrees: float = 0.0, klux: float = 0.0,
        frames: int = 150, seed: int = 0,
    ) -> Seen:  # fmt: skip
        """At a wall `distance` [m] ahead along the axis, turned by `degrees`."""
        T, a = np.eye(4), np.radians(degrees)
        T[:3, :3] = [[np.cos(a), 0.0, np.sin(a)], [0.0, 1.0, 0.0], [-np.sin(a), 0.0, np.cos(a)]]
        T[2, 3] = distance
        shape = shape_of(PanelShape((12.0, 12.0), 1e-4), Path(), "wall")
        motion = Still(freeze(self.posture.T_base_link[-1] @ T))
        world = World((Body("wall", shape, (0, 0, 0), motion, True, reflectance),))
        eye = SimulatedSkin(
            self.robot, self.skin, world, seed, ErrorModel(light_klux=klux), 0.0, _ALONE
        )
        found = [f for i in range(frames) for f in eye.poll(i / 15.0, self.posture)]
        status = np.array([f.status for f in found])
        good = np.isin(status, BELIEVED) & (np.array([f.targets for f in found]) > 0)
        return Seen(np.where(good, np.array([f.distance for f in found]), np.nan), status)


# the sensor alone: where it sits, and when, is another matter
_ALONE = Budget(
    mounting=0.0, encoders=0.0, kinematics=0.0, time=0.0, body=0.0, cover=0.0,
    light=0.0, zones=HONEST.zones, ranges=HONEST.ranges, sub=HONEST.sub,
)  # fmt: skip


def noise_of(distance: Array) -> Array:
    """(n,) [m] standard deviation of each zone's reports (F, n), see above; NaN of too few."""
    d = distance[:-2] - 2.0 * distance[1:-1] + distance[2:]
    known = np.isfinite(d).sum(axis=0) >= 10
    middle = 1.4826 * np.nanmedian(
        np.abs(np.where(known, d, 0.0)), axis=0
    )  # robust: steps stay out
    return np.where(known, middle / np.sqrt(6.0), np.nan)


def _distance_row(
    bench: _Bench, d: float, shade: str, frames: int, seeds: int, seed: int
) -> dict[str, Any]:
    seen = [bench.look(d, SHADES[shade], frames=frames, seed=seed + i) for i in range(seeds)]
    distance = np.array([s.distance for s in seen])
    found, off = np.isfinite(distance), _mean(distance) - d
    within = np.abs(distance[found] / d - 1.0) < 0.05
    return {
        "name": f"{shade} wall at {d:.3g} m", "shade": shade, "distance_m": d,
        "noise_m": _median([noise_of(s.distance) for s in seen]),
        "mean_error_m": _of(np.mean, off), "zone_error_m": _of(np.std, off),
        "within_5_percent": _of(np.mean, within),
        "valid_share": float(found.mean()),
    }  # fmt: skip


def _angle_row(bench: _Bench, degrees: float, frames: int, seeds: int, seed: int) -> dict[str, Any]:
    """Zones of the middle columns: they look along the axis, and meet the wall at its angle."""
    tan = np.tan(np.radians(degrees))
    a = np.tan((np.arange(8) - 3.5) * np.radians(45.0 / 8))  # of each column's middle
    true = np.tile(ASLANT / (1.0 + a * tan), 8)
    seen = [bench.look(ASLANT, 0.5, degrees, 0.0, frames, seed + i).distance for i in range(seeds)]
    off = (_mean(np.array(seen)) / true - 1.0)[:, INNER]
    return {
        "name": f"wall at {degrees:g} degrees", "degrees": degrees, "distance_m": ASLANT,
        "noise_m": _median([noise_of(s)[INNER] for s in seen]),
        "mean_error_share": _of(np.mean, off), "zone_error_share": _of(np.std, off),
        "valid_share": float(np.mean([np.isfinite(s[:, INNER]) for s in seen])),
    }  # fmt: skip


def _reach_row(
    bench: _Bench, shade: str, klux: float, d: float, frames: int, seed: int
) -> dict[str, Any]:
    """A target of the datasheet where that says that it is found in 90 % of the frames."""
    status = bench.look(d, SHADES[shade], 0.0, klux, frames, seed).status
    return {
        "name": f"{shade} at {klux:g} klux", "reach_m": d,
        "found_share": float(np.mean(status[:, INNER] != 255)),
    }  # fmt: skip


def _recorded_rows(logs: list[Path]) -> list[dict[str, Any]]:
    """Noise of recorded zones by distance, in windows of a second."""
    parts: list[tuple[Array, Array]] = []
    valid: list[float] = []
    for log in logs:
        r = read_recording(log)
        new = np.append(True, np.diff(r.stamp) > 0.0)  # a stamp that comes twice is one frame
        seen = (r.targets > 0) & (r.status != 255)
        good = seen & np.isin(r.status, BELIEVED)
        valid.append(float(good[seen].mean()) if seen.any() else np.nan)
        distance = np.where(good, r.distance, np.nan)[new]
        for i in range(0, len(distance) - 15, 15):
            part = distance[i : i + 15]
            some = np.isfinite(part).sum(axis=0) > 12
            if some.any():
                parts.append((np.nanmedian(part[:, some], axis=0), noise_of(part[:, some])))
    if not parts:
        return []
    at, noise = (np.concatenate(column) for column in zip(*parts, strict=True))
    rows: list[dict[str, Any]] = []
    for low, high, _ in MEASURED:
        here = noise[(at >= low) & (at < high) & np.isfinite(noise)]
        if len(here) >= 30:
            rows.append({
                "name": f"recorded, {low:g} to {high:g} m", "recorded": True,
                "distance_m": (low + high) / 2.0, "noise_m": float(np.median(here)),
                "windows": len(here),
            })  # fmt: skip
    rows.append({"name": "recorded, valid of what was seen", "share": float(np.nanmean(valid))})
    return rows


def _median(parts: list[Array]) -> float:
    return _of(np.median, np.concatenate(parts))


def _of(function: Callable[[Any], Any], values: NDArray[Any]) -> float:
    """Of the finite ones; NaN without any."""
    known = values[np.isfinite(values)]
    return float(function(known)) if len(known) else float("nan")


def _mean(distance: Array) -> Array:
    """(n, 64) over the frames (n, F, 64); NaN where there is none."""
    count = np.isfinite(distance).sum(axis=1)
    total = np.where(count > 0, np.nansum(distance, axis=1), np.nan)
    return np.asarray(total / np.maximum(count, 1))


def _checks(rows: list[dict[str, Any]]) -> list[Check]:
    out = []
    noise = {(r["shade"], r["distance_m"]): r for r in rows if "shade" in r}
    for d, (_, _, sigma) in zip(_middles(), MEASURED, strict=True):
        row = noise["white", d]
        if row["valid_share"] > 0.5:
            times = row["noise_m"] / sigma
            out.append(Check(f"noise at {d:.3g} m, times measured", times, "", LIKE[1]))
            out.append(Check(f"noise at {d:.3g} m, times measured", times, "", LIKE[0], True))
    near = [r for r in noise.values() if r["shade"] != "dark" and 0.2 <= r["distance_m"] <= 0.9]
    # DS13754: 2.7 sigma within 5 % in the dark
    out.append(Check("share within 5 %", min(r["within_5_percent"] for r in near), "", 0.97, True))
    out.append(Check("invalid share", 1.0 - min(r["valid_share"] for r in near), "", INVALID))
    for r in rows:
        if "reach_m" in r:
            out.append(Check(f"{r['name']} found", r["found_share"], "", 0.85, True))
            out.append(Check(f"{r['name']} found", r["found_share"], "", 0.95))
    recorded = {r["distance_m"]: r["noise_m"] for r in rows if "recorded" in r}
    for d, sigma in recorded.items():
        times = noise["grey", d]["noise_m"] / sigma
        if noise["grey", d]["valid_share"] > 0.5:
            out.append(Check(f"noise of grey at {d:.3g} m, times recorded", times, "", LIKE[1]))
    return out
