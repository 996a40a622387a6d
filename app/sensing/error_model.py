"""What a VL53L8CX makes of the truth: noise, bias, dropout and status codes.

Figures: noise and bias measured on real 8x8 frames with motion-capture ground truth
(std 0.9 mm at 0.15 m, 9.7 mm at 1.75 m: about max(0.7 mm, 0.65 %)); ranges of 90 % detection
from the datasheet (DS13754: white 88 % target 3.5 m in the dark and 1.1 m at 5 klux, grey
17 % target 1.3 m and 0.8 m; corner zones 11 to 15 % less).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.messages import SLOTS, Array

VALID, MERGED, FIRST, UNCONFIRMED, NO_TARGET = 5, 9, 6, 10, 255
MERGE_DEPTH = 0.6  # [m] two targets in a zone separate only beyond this


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

    def detection(self, depth: Array, range_90: Array) -> Array:
        """Probability of a target at `depth`: logistic, 90 % at `range_90`, steep as its 8 %."""
        width = 0.08 * range_90
        x = np.clip((depth - range_90) / width - np.log(9.0), -60.0, 60.0)
        return 1.0 / (1.0 + np.exp(x))


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
