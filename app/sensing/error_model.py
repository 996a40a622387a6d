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
USUAL = 0.5  # reflectance of the targets on which a type's noise was measured
AMBIENT = 0.6  # [1/klux] light that adds to the noise: twice the deviation at 5 klux (DS13754)
SMUDGED = 0.001  # share of frames and zones in which a dirty window is taken for a target
LEAST_NOISE, MOST_NOISE = 0.8, 3.0  # times a type's noise, of a bright and of a dark target


class Reading(NamedTuple):
    """The truth of one frame before the error model, (n,) each.

    depth: [m] what an ideal sensor would report of the nearest cluster in the zone, +inf if none.
    merged: another surface stands so near behind it that the sensor cannot tell them apart.
    label: body link that was hit, -1 the world, -2 nothing.
    pure:  every sub-ray of the zone has the same label.
    bright: reflectance of the square surface over all of the zone that would send as much light
           back from there; NaN: everything has that of the `ErrorModel`.
    """

    depth: Array
    merged: NDArray[np.bool_]
    label: NDArray[np.int16]
    pure: NDArray[np.bool_]
    bright: Array


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
    reach:    how far targets are found.   slope: share of the distance of 90 % detection in
              which it falls.   by_signal: power with which noise grows as the signal falls.
    ambient:  times the noise's variance.
    rejections: (r,) codes; likely: (r,) summed shares.   strays: share of returns from nothing.
    smudged:  share of returns from a dirty window, and [m] where it is.
    """

    farthest: float
    noise: Array
    near: Array
    bias: Array
    reach: "Reach"
    slope: float
    by_signal: float
    ambient: float
    rejections: NDArray[np.uint8]
    likely: Array
    strays: float
    smudged: Array
    codes: Codes
    ideal: bool


class Reach(NamedTuple):
    """How far a sensor finds targets in 90 % of its frames: [m] in the middle of the picture

        dark + light (bright - dark),       each = c rho^p

    c, p: (2,) in the dark and in bright light; rho: of the target, `usual` where it is not known.
    light: share of the bright light.   corner: (n,) of each zone, 1 in the middle.
    """

    c: Array
    p: Array
    usual: float
    light: float
    corner: Array


class Measured(NamedTuple):
    """What a frame reports, (n,) each: distance [m], status and number of targets."""

    distance: Array
    status: NDArray[np.uint8]
    targets: NDArray[np.uint8]


@dataclass(frozen=True)
class ErrorModel:
    """How far from ideal the simulated sensors are.

    reflectance:  of what has none of its own, 0.17 (grey) .. 0.88 (white).
    light_klux:   ambient light, 0 .. 5.
    bias:         times the bias and the offset near the lens that zones of the type have.
    rejected:     times the share of measurements with a rejected status.
    ghosts:       share of zones and frames with a near return of good status from nothing.
    ideal:        switch all of it off; only geometry and range limits stay.
    by_signal:    power with which noise grows as the returned signal falls; 0: it does not.
    """

    reflectance: float = 0.5
    light_klux: float = 0.0
    bias: float = 1.0
    rejected: float = 1.0
    ideal: bool = False
    ghosts: float = 0.0
    by_signal: float = 0.0

    def flaws(self, kind: SensorType, streams: Streams, window: float = 0.0) -> Flaws:
        """Those of one sensor; what is drawn for good comes from its `streams`.

        window: [m] where its window is, if that is dirty.
        """
        e = kind.error
        drawn = e.bias_share * streams.bias.standard_normal(kind.zones)
        shares = [self.rejected * r.share for r in e.rejected]
        return Flaws(
            farthest=kind.most_m,
            noise=np.array([e.noise_floor_m, e.noise_share]),
            near=np.array([self.bias * e.near_offset_m, e.near_offset_below_m]),
            bias=self.bias * np.clip(drawn, -MOST_BIAS, MOST_BIAS),
            reach=self.reach(kind),
            slope=kind.detection.slope_share,
            by_signal=self.by_signal,
            ambient=1.0 + AMBIENT * self.light_klux,
            rejections=np.array([r.status for r in e.rejected], dtype=np.uint8),
            likely=np.cumsum(np.array(shares, dtype=np.float64)),
            strays=self.ghosts,
            smudged=np.array([SMUDGED if window else 0.0, window]),
            codes=_codes(kind),
            ideal=self.ideal,
        )

    def reach(self, kind: SensorType) -> Reach:
        """Through both targets of the datasheet as a power of the reflectance; falls towards the
        corners as the square of the distance from the middle."""
        d = kind.detection
        pairs = (d.white.dark_m, d.grey.dark_m), (d.white.bright_m, d.grey.bright_m)
        p = np.array([_exponent(d, *pair) for pair in pairs])
        row, column = np.divmod(np.arange(kind.zones), kind.columns)
        middle, centre = (kind.rows - 1) / 2, (kind.columns - 1) / 2
        off = np.hypot(row - middle, column - centre) / max(np.hypot(middle, centre), 0.5)
        return Reach(
            c=np.array([white for white, _ in pairs]) / d.white.reflectance**p,
            p=p,
            usual=self.reflectance,
            light=min(max(self.light_klux / d.bright_klux, 0.0), 1.0),
            corner=1.0 - d.corner_less * off**2,
        )

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
            known = truth.bright[z] == truth.bright[z]
            rho = truth.bright[z] if known else flaws.reach.usual
            seen = seen and draws.detection[z] < _detected(d, rho, z, flaws)
            offset = near[0] * min(max(1.0 - d / near[1], 0.0), 1.0)
            sigma = max(noise[0], noise[1] * d)
            if known:
                sigma *= _louder(rho, flaws)
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
            elif 1.0 - draws.stray[0, z] < flaws.smudged[0]:
                d, seen, status = flaws.smudged[1], True, codes.valid
            if not seen:  # what a real sensor leaves in a zone without a target is stale junk
                d = 0.02 + 1.98 * draws.junk[z]
        had_target[z] = seen
        out.distance[z] = np.rint(max(d, 0.0) * 1000.0) / 1000.0
        out.status[z] = status if seen else codes.no_target
        out.targets[z] = seen


@compiled
def _detected(d: float, rho: float, zone: int, flaws: Flaws) -> float:
    """Probability of a target of this reflectance at d: logistic, 90 % where `Reach` says, steep
    as `slope` times that."""
    reach = flaws.reach
    dark, bright = reach.c[0] * rho ** reach.p[0], reach.c[1] * rho ** reach.p[1]
    range_90 = (dark + reach.light * (bright - dark)) * reach.corner[zone]
    x = (d - range_90) / (flaws.slope * range_90) - np.log(9.0)
    return float(1.0 / (1.0 + np.exp(min(x, 700.0))))


@compiled
def _louder(rho: float, flaws: Flaws) -> float:
    """Times a type's noise: photons are counted, so it goes with 1 / sqrt(signal)."""
    factor = np.sqrt(flaws.ambient * USUAL / max(rho, 1e-6))
    return float(min(max(factor, LEAST_NOISE), MOST_NOISE) ** flaws.by_signal)
