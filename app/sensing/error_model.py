"""What a VL53L8CX makes of the truth: noise, bias, dropout and status codes.

Figures: noise and bias measured on real 8x8 frames with motion-capture ground truth
(std 0.9 mm at 0.15 m, 9.7 mm at 1.75 m: about max(0.7 mm, 0.65 %)); ranges of 90 % detection
from the datasheet (DS13754: white 88 % target 3.5 m in the dark and 1.1 m at 5 klux, grey
17 % target 1.3 m and 0.8 m; corner zones 11 to 15 % less).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import SLOTS, Array
from app.robot.skin import NOISE_FLOOR, NOISE_SHARE
from app.sensing.streams import NOTHING, Draws, Streams

VALID, MERGED, FIRST, UNCONFIRMED, NO_TARGET = 5, 9, 6, 10, 255
MERGE_DEPTH = 0.6  # [m] two targets in a zone separate only beyond this
MOST_BIAS = 0.04  # share of distance; no zone is wrong by more


@dataclass(frozen=True, eq=False, slots=True)
class Reading:
    """The truth of one frame before the error model, (64,) each.

    depth: [m] perpendicular depth of the nearest cluster in the zone, +inf if none.
    merged: another surface stands less than 0.6 m behind it in the same zone.
    label: body link that was hit, -1 the world, -2 nothing.
    pure:  every sub-ray of the zone has the same label.
    """

    depth: Array
    merged: NDArray[np.bool_]
    label: NDArray[np.int16]
    pure: NDArray[np.bool_]


class Sizes(NamedTuple):
    """What the kernel needs of an `ErrorModel`."""

    near_offset: float
    near_range: float
    bad_4: float
    bad_2: float
    ghosts: float
    ideal: bool


@dataclass(frozen=True)
class ErrorModel:
    """How far from ideal the simulated sensors are.

    reflectance:  of everything in the world, 0.17 (grey) .. 0.88 (white).
    light_klux:   ambient light, 0 .. 5.
    zone_bias:    1-sigma share of distance that a zone is constantly wrong by.
    near_offset:  [m] added below `near_range` [m].
    bad_4, bad_2: share of measurements with a rejected status, as in real logs.
    ghosts:       share of zones and frames with a near return of good status from nothing.
    ideal:        switch all of it off; only geometry and range limits stay.
    """

    reflectance: float = 0.5
    light_klux: float = 0.0
    zone_bias: float = 0.015
    near_offset: float = 0.005
    near_range: float = 0.2
    bad_4: float = 0.04
    bad_2: float = 0.02
    ideal: bool = False
    ghosts: float = 0.0

    def range_90(self, resolution: int) -> Array:
        """(64,) [m] distance up to which 90 % of the measurements find a target."""
        dark = 3.5 * (self.reflectance / 0.88) ** 0.602  # through both datasheet targets
        bright = 1.1 * (self.reflectance / 0.88) ** 0.194
        share = min(max(self.light_klux / 5.0, 0.0), 1.0)
        centre = dark + share * (bright - dark)
        zones = np.full(SLOTS, np.nan)
        row, column = np.divmod(np.arange(resolution**2), resolution)
        middle = (resolution - 1) / 2
        off = np.hypot(row - middle, column - middle) / np.hypot(middle, middle)
        zones[: resolution**2] = centre * (1.0 - 0.115 * off**2)
        return zones

    def measure(
        self,
        truth: Reading,
        far: float,
        range_90: Array,
        bias: Array,
        had_target: NDArray[np.bool_],
        first: bool,
        streams: Streams,
    ) -> tuple[Array, NDArray[np.uint8], NDArray[np.uint8]]:
        """Distance [m], status and number of targets, (64,) each, that a frame reports of `truth`.

        far: [m] nothing is seen beyond.   range_90: (64,) as of the method of this name.
        bias: (64,) share of the distance.   had_target: (64,) in the sensor's last frame; becomes
        that of this one.   first: of the sensor's frames.   streams: the sensor's own.
        """
        distance = np.empty(SLOTS)
        status, targets = (np.empty(SLOTS, dtype=np.uint8) for _ in range(2))
        sizes = Sizes(
            self.near_offset, self.near_range, self.bad_4, self.bad_2, self.ghosts, self.ideal
        )
        _measure(
            truth.depth, truth.merged, far, range_90, bias, had_target, first, sizes,
            NOTHING if self.ideal else streams.draw(), distance, status, targets,
        )  # fmt: skip
        return distance, status, targets

    def bias(self, streams: Streams) -> Array:
        """(64,) share of the distance that each zone of a sensor is constantly wrong by."""
        drawn = self.zone_bias * streams.bias.standard_normal(SLOTS)
        return np.clip(drawn, -MOST_BIAS, MOST_BIAS)


@compiled
def _measure(
    depth: Array,
    merged: NDArray[np.bool_],
    far: float,
    range_90: Array,
    bias: Array,
    had_target: NDArray[np.bool_],
    first: bool,
    sizes: Sizes,
    draws: Draws,
    distance: Array,
    status: NDArray[np.uint8],
    targets: NDArray[np.uint8],
) -> None:
    for z in range(len(depth)):
        seen = depth[z] <= far
        d = depth[z] if seen else 1.0
        said = MERGED if merged[z] else VALID
        if not sizes.ideal:
            # detection is logistic, 90 % at `range_90` and steep as the datasheet's 8 %
            x = (d - range_90[z]) / (0.08 * range_90[z]) - np.log(9.0)
            seen = seen and draws.detection[z] < 1.0 / (1.0 + np.exp(x))
            near = sizes.near_offset * min(max(1.0 - d / sizes.near_range, 0.0), 1.0)
            d = d * (1.0 + bias[z]) + near + draws.noise[z] * max(NOISE_FLOOR, NOISE_SHARE * d)
            if draws.status[z] < sizes.bad_4:
                said = 4
            elif draws.status[z] < sizes.bad_4 + sizes.bad_2:
                said = 2
            elif seen and not had_target[z] and said == VALID:
                said = FIRST if first else UNCONFIRMED
            if draws.stray[0, z] < sizes.ghosts:
                d, seen, said = 0.05 + 0.95 * draws.stray[1, z], True, VALID
            if not seen:  # what a real sensor leaves in a zone without a target is stale junk
                d = 0.02 + 1.98 * draws.junk[z]
        had_target[z] = seen
        distance[z] = np.rint(max(d, 0.0) * 1000.0) / 1000.0
        status[z] = said if seen else NO_TARGET
        targets[z] = seen
