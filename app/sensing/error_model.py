"""What a sensor makes of the truth: noise, bias, dropout and status codes.

How large they are is a fact of its type (`app.robot.sensor_type`); how much of it shows, in which
light and on what, is the `ErrorModel`.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.robot.sensor_type import DetectionTable, SensorType
from app.sensing.streams import Draws, Streams, no_draws

MOST_BIAS = 0.04  # share of distance; no zone is wrong by more


class Reading(NamedTuple):
    """The truth of one frame before the error model, (n,) each.

    depth: [m] what an ideal sensor would report of the nearest cluster in the zone, +inf if none.
    merged: another surface stands so near behind it that the sensor cannot tell them apart.
    label: body link that was hit, -1 the world, -2 nothing.
    pure:  every sub-ray of the zone has the same label.
    """

    depth: Array
    merged: NDArray[np.bool_]
    label: NDArray[np.int16]
    pure: NDArray[np.bool_]


class Codes(NamedTuple):
    """The statuses of a type; those that it does not have are `valid`."""

    valid: int
    merged: int
    first: int
    unconfirmed: int
    no_target: int


class Flaws(NamedTuple):
    """What is constant of one simulated sensor.

    farthest: [m] nothing is seen beyond.   noise: (2,) [m] and share of the distance.
    near:     (2,) [m] offset at the lens, and up to where.   bias: (n,) share of the distance.
    range_90: (n,) [m] of 90 % detection.   slope: share of it in which detection falls.
    rejections: (r,) codes; likely: (r,) summed shares.   strays: share of returns from nothing.
    """

    farthest: float
    noise: Array
    near: Array
    bias: Array
    range_90: Array
    slope: float
    rejections: NDArray[np.uint8]
    likely: Array
    strays: float
    codes: Codes
    ideal: bool


class Measured(NamedTuple):
    """What a frame reports, (n,) each: distance [m], status and number of targets."""

    distance: Array
    status: NDArray[np.uint8]
    targets: NDArray[np.uint8]


@dataclass(frozen=True)
class ErrorModel:
    """How far from ideal the simulated sensors are.

    reflectance:  of everything in the world, 0.17 (grey) .. 0.88 (white).
    light_klux:   ambient light, 0 .. 5.
    bias:         times the bias and the offset near the lens that zones of the type have.
    rejected:     times the share of measurements with a rejected status.
    ghosts:       share of zones and frames with a near return of good status from nothing.
    ideal:        switch all of it off; only geometry and range limits stay.
    """

    reflectance: float = 0.5
    light_klux: float = 0.0
    bias: float = 1.0
    rejected: float = 1.0
    ideal: bool = False
    ghosts: float = 0.0

    def flaws(self, kind: SensorType, streams: Streams) -> Flaws:
        """Those of one sensor; what is drawn for good comes from its `streams`."""
        e = kind.error
        drawn = e.bias_share * streams.bias.standard_normal(kind.zones)
        shares = [self.rejected * r.share for r in e.rejected]
        return Flaws(
            farthest=kind.most_m,
            noise=np.array([e.noise_floor_m, e.noise_share]),
            near=np.array([self.bias * e.near_offset_m, e.near_offset_below_m]),
            bias=self.bias * np.clip(drawn, -MOST_BIAS, MOST_BIAS),
            range_90=self.range_90(kind),
            slope=kind.detection.slope_share,
            rejections=np.array([r.status for r in e.rejected], dtype=np.uint8),
            likely=np.cumsum(np.array(shares, dtype=np.float64)),
            strays=self.ghosts,
            codes=_codes(kind),
            ideal=self.ideal,
        )

    def range_90(self, kind: SensorType) -> Array:
        """(n,) [m] distance up to which 90 % of the measurements find a target.

        Through both targets of the datasheet as a power of the reflectance; falls towards the
        corners as the square of the distance from the middle.
        """
        d = kind.detection
        over_white = self.reflectance / d.white.reflectance
        dark = d.white.dark_m * over_white ** _exponent(d, d.white.dark_m, d.grey.dark_m)
        bright = d.white.bright_m * over_white ** _exponent(d, d.white.bright_m, d.grey.bright_m)
        share = min(max(self.light_klux / d.bright_klux, 0.0), 1.0)
        row, column = np.divmod(np.arange(kind.zones), kind.columns)
        middle, centre = (kind.rows - 1) / 2, (kind.columns - 1) / 2
        off = np.hypot(row - middle, column - centre) / max(np.hypot(middle, centre), 0.5)
        return np.asarray((dark + share * (bright - dark)) * (1.0 - d.corner_less * off**2))

    def measure(
        self,
        truth: Reading,
        flaws: Flaws,
        had_target: NDArray[np.bool_],
        first: bool,
        streams: Streams,
    ) -> Measured:
        """What a frame reports of `truth`.

        flaws: of the sensor.   had_target: (n,) in its last frame; becomes that of this one.
        first: of the sensor's frames.   streams: the sensor's own.
        """
        n = len(truth.depth)
        out = Measured(np.empty(n), np.empty(n, dtype=np.uint8), np.empty(n, dtype=np.uint8))
        draws = no_draws(n) if self.ideal else streams.draw(n)
        _measure(truth, flaws, had_target, first, draws, out)
        return out


def _codes(kind: SensorType) -> Codes:
    s = kind.status
    merged, first, unconfirmed = (
        s.valid if code is None else code for code in (s.merged, s.first, s.unconfirmed)
    )
    return Codes(s.valid, merged, first, unconfirmed, s.no_target)


def _exponent(d: DetectionTable, white: float, grey: float) -> float:
    """p of range = c * reflectance^p through both targets; a datasheet carries two digits."""
    return round(float(np.log(white / grey) / np.log(d.white.reflectance / d.grey.reflectance)), 3)


@compiled
def _measure(
    truth: Reading,
    flaws: Flaws,
    had_target: NDArray[np.bool_],
    first: bool,
    draws: Draws,
    out: Measured,
) -> None:
    """Zone by zone: is a target found, d (1 + bias) + offset near the lens + noise, its status."""
    codes, noise, near = flaws.codes, flaws.noise, flaws.near
    for z in range(len(truth.depth)):
        seen = truth.depth[z] <= flaws.farthest
        d = truth.depth[z] if seen else 1.0
        status = codes.merged if truth.merged[z] else codes.valid
        if not flaws.ideal:
            seen = seen and draws.detection[z] < _detected(d, flaws.range_90[z], flaws.slope)
            offset = near[0] * min(max(1.0 - d / near[1], 0.0), 1.0)
            sigma = max(noise[0], noise[1] * d)
            d = d * (1.0 + flaws.bias[z]) + offset + draws.noise[z] * sigma
            rejection = -1
            for i in range(len(flaws.likely) - 1, -1, -1):
                if draws.status[z] < flaws.likely[i]:
                    rejection = flaws.rejections[i]
            if rejection >= 0:
                status = rejection
            elif seen and not had_target[z] and status == codes.valid:
                status = codes.first if first else codes.unconfirmed
            if draws.stray[0, z] < flaws.strays:
                d, seen, status = 0.05 + 0.95 * draws.stray[1, z], True, codes.valid
            if not seen:  # what a real sensor leaves in a zone without a target is stale junk
                d = 0.02 + 1.98 * draws.junk[z]
        had_target[z] = seen
        out.distance[z] = np.rint(max(d, 0.0) * 1000.0) / 1000.0
        out.status[z] = status if seen else codes.no_target
        out.targets[z] = seen


@compiled
def _detected(d: float, range_90: float, slope: float) -> float:
    """Probability of a target at d: logistic, 90 % at `range_90`, steep as slope * range_90."""
    x = (d - range_90) / (slope * range_90) - np.log(9.0)
    return float(1.0 / (1.0 + np.exp(x)))
