"""What a type of sensor is: where its zones look, what it reports of them and how it errs.

A type is a TOML file, `static_assets/sensors/vl53l8cx.toml` say; everything that the app knows
of a sensor is in it, each number with its source. The zones are a grid in the sensor's field of
view, of equal angles: of n zones in a view of width w, zone i looks at an angle of

    a_i = (i - (n - 1) / 2) * w / n

to the optical axis. A sensor reports, zone by zone from the upper left as it looks out, either
the depth along its axis (`perpendicular`) or the length of the zone's ray (`radial`).
"""

from math import radians
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from app.assets import asset_folder, find_asset
from app.errors import RobotError
from app.messages import Array
from app.toml import NotNegative, Positive, Table, read_toml

Share = Annotated[float, Meta(ge=0, le=1)]
Angle = Annotated[float, Meta(gt=0, le=120)]
Zones = Annotated[int, Meta(ge=1, le=32)]
Status = Annotated[int, Meta(ge=0, le=255)]

DEFAULT = "vl53l8cx"
PERPENDICULAR, RADIAL = "perpendicular", "radial"
STALE_FRAMES = 3.0  # periods without a frame after which the last one no longer counts


class StatusTable(Table, frozen=True, kw_only=True):
    """`[status]`: the codes by which a sensor says what a zone's distance is worth.

    valid, merged, first, unconfirmed: a target; two surfaces in one pulse; a target in the
    sensor's first frame; one where the last frame had none.   no_target: nothing is there.
    trusted: the codes that are believed. Every code that is not named here is a rejection.
    """

    valid: Status
    no_target: Status
    trusted: Annotated[tuple[Status, ...], Meta(min_length=1)]
    merged: Status | None = None
    first: Status | None = None
    unconfirmed: Status | None = None

    @property
    def honest(self) -> tuple[int, ...]:
        """Codes of a zone that works, whether it sees anything or not."""
        named = (self.valid, self.merged, self.first, self.unconfirmed, self.no_target)
        return tuple(code for code in named if code is not None)


class RejectionTable(Table, frozen=True, kw_only=True):
    """`[[error.rejected]]`: how often a measurement comes with a code that rejects it."""

    status: Status
    share: Share


class ErrorTable(Table, frozen=True, kw_only=True):
    """`[error]`: what a report is wrong by.

    noise_floor_m, noise_share: standard deviation = max(floor, share * distance).
    bias_share:  standard deviation of the share of the distance that each zone is always off by.
    near_offset_m: added at the lens, less and less up to `near_offset_below_m`.
    """

    noise_floor_m: Positive
    noise_share: NotNegative
    bias_share: NotNegative = 0.0
    near_offset_m: float = 0.0
    near_offset_below_m: Positive = 1.0
    rejected: tuple[RejectionTable, ...] = ()


class TargetTable(Table, frozen=True, kw_only=True):
    """`[detection.white]`, `[detection.grey]`: how far a target of this reflectance is found in
    90 % of the frames, in the dark and in bright light."""

    reflectance: Annotated[float, Meta(gt=0, le=1)]
    dark_m: Positive
    bright_m: Positive


class DetectionTable(Table, frozen=True, kw_only=True):
    """`[detection]`: how far targets are found.

    bright_klux: of the bright light.   corner_less: share by which a corner zone sees less far
    than the middle.   slope_share: of the 90 % distance; how fast detection falls beyond it.
    """

    white: TargetTable
    grey: TargetTable
    bright_klux: Positive
    corner_less: Share = 0.0
    slope_share: Positive = 0.08


class SensorType(Table, frozen=True, kw_only=True):
    """A type of sensor.

    rows, columns:     of its zones.   field_of_view_deg: across the columns, across the rows.
    range:             what a distance is: "perpendicular" or "radial".
    least_m, most_m:   distances that are believed.   rate_hz: frames a second.
    integration_s:     light is sent for so long a frame; left out: without a pause.
    pulse_m, pulse_share: returns within max(m, share * distance) of a zone's nearest one are one
                       target, whose distance is their mean; a slanted surface is one.
    separate_m:        a second target this far behind is told apart; a nearer one merges.
    footprint:         a zone is stood for by so many rays in a row, and so many rows of them,
                       evenly over it; odd, so that one is in its middle.
    """

    title: str
    rows: Zones
    columns: Zones
    field_of_view_deg: tuple[Angle, Angle]
    range: Literal["perpendicular", "radial"]
    least_m: NotNegative
    most_m: Positive
    rate_hz: Annotated[float, Meta(gt=0, le=200)]
    pulse_m: Positive
    pulse_share: NotNegative
    separate_m: Positive
    status: StatusTable
    error: ErrorTable
    detection: DetectionTable
    footprint: Literal[1, 3, 5, 7] = 3
    integration_s: Positive | None = None

    @property
    def zones(self) -> int:
        """Number of zones."""
        return self.rows * self.columns

    @property
    def grid(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rows, self.columns

    @property
    def radial(self) -> bool:
        """Does it report the length of a ray, rather than the depth along its axis?"""
        return self.range == RADIAL

    @property
    def pitch(self) -> tuple[float, float]:
        """Angle [rad] from a row to the next, and from a column to the next."""
        across, down = self.field_of_view_deg
        return radians(down) / self.rows, radians(across) / self.columns

    @property
    def period(self) -> float:
        """[s] from frame to frame."""
        return 1.0 / self.rate_hz

    @property
    def integration(self) -> float:
        """[s] that light is sent for, a frame."""
        return self.period if self.integration_s is None else self.integration_s

    def noise(self, distance: Array) -> Array:
        """Standard deviation [m] of reported distances [m], the same shape."""
        return np.maximum(self.error.noise_floor_m, self.error.noise_share * np.abs(distance))

    @property
    def oldest(self) -> float:
        """[s] an older frame is stale."""
        return STALE_FRAMES / self.rate_hz


def load_sensor_type(name: str, beside: Path | None = None) -> SensorType:
    """A type by the name of a shipped one, or by the path of a TOML file, also from the folder
    `beside`; a RobotError names file, key and remedy, or the known names."""
    path = beside / name if beside is not None else Path(name)
    if not path.is_file():
        folder = asset_folder("static_assets") / "sensors"
        path = find_asset(name, folder, ".toml", RobotError)
    kind = read_toml(path, SensorType, RobotError)
    wrong = _contradiction(kind)
    if wrong:
        raise RobotError(f"{path}: {wrong}")
    return kind


def _contradiction(kind: SensorType) -> str:
    """What of a type does not fit the rest of it, with the remedy; empty if all does."""
    if kind.least_m >= kind.most_m:
        return f"least_m = {kind.least_m:g} is not below most_m = {kind.most_m:g}; lower it"
    if kind.integration > kind.period:
        return f"integration_s = {kind.integration:g} is longer than a period; lower it or rate_hz"
    if kind.status.no_target in kind.status.trusted:
        return f"status: trusted holds no_target = {kind.status.no_target}; leave it out"
    if kind.detection.white.reflectance <= kind.detection.grey.reflectance:
        return "detection: white reflects no more than grey; swap them"
    return ""
