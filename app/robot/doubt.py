"""How well a skin is known: one standard deviation of what is believed of its sensors.

What a layout says of a sensor that was put on by hand is off by millimetres; after
`flinch calibrate mounts` it is known better, and the margins of the filters shrink with it.
"""

from dataclasses import dataclass

import numpy as np

from app.messages import Array, freeze

# of a printed cover on a tube, and of what a UR's encoders report (specification, section 6.1)
POSITION, ANGLE, JOINT = 2e-3, np.radians(0.5), 1e-4  # [m], [rad] a component, [rad]
SHARE = 0.015  # of the distance, of a zone's constant error: real VL53L5CX frames
TIME = 2e-3  # [s] of a frame's stamp, where its sensor has a clock


@dataclass(frozen=True, eq=False, slots=True)
class Doubt:
    """One standard deviation, of K sensors.

    position: (K,) [m] of the lens, along each axis.   angle: (K,) [rad] about each axis.
    share:    (K,) of the distance, of a zone's constant error.
    time:     (K,) [s] of a frame's stamp.   joint: [rad] of a joint's reported position.
    """

    position: Array
    angle: Array
    share: Array
    time: Array
    joint: float = JOINT


def as_laid_out(sensors: int) -> Doubt:
    """Of a skin that nobody has calibrated."""
    position, angle, share, time = (
        freeze(np.full(sensors, value)) for value in (POSITION, ANGLE, SHARE, TIME)
    )
    return Doubt(position, angle, share, time)
