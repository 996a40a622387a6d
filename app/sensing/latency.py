"""How old a frame is when it arrives, where no clock of the board tells.

What is known of it: the bytes of the frame take their time on the line, and the sensor sends its
light before that, so that the middle of the measurement is half of that time earlier,

    latency = integration / 2 + 10 size / baud

(a byte is ten bits on the line: start, eight, stop). What the board does in between is not known:
it reads the sensor (1452 bytes, 33 ms of a 400 kHz I2C bus and 13 ms of one of 1 MHz), polls for
a new measurement and hands it to a USB chip that waits for more (1 to 16 ms). A person who has
measured it gives `latency_ms`, or `flinch calibrate mounts` estimates it.
"""

from collections.abc import Sequence

import numpy as np

from app.messages import Array
from app.robot.sensor_type import SensorType
from app.sensing.port_spec import PortSpec
from app.sensing.wire.detect import FORMATS

BITS = 10  # of a byte on the line
NO_LINE = "/dev/ttyACM"  # boards with USB of their own: their speed is a name, nothing is slow
# [s], 1 sigma of a stamp: where only size and speed are known, what is left out above is spread
# over 50 ms; a latency that was measured varies with the board's polling; a board's own clock is
# read when its loop comes to it.
ESTIMATED, TOLD, CLOCKED = 0.015, 0.005, 0.003


def latency(spec: PortSpec, kind: SensorType, clocked: bool, size: float, baud: int) -> float:
    """[s] from the middle of a measurement to its arrival, or to its stamp where it is `clocked`.

    size: [bytes] of the frame on the line, whose speed is `baud`, 0 where that means nothing.
    """
    if spec.latency is not None:
        return spec.latency
    if clocked:
        return 0.0
    line = 0 if spec.port.startswith(NO_LINE) else baud
    return kind.integration / 2 + (BITS * size / line if line else 0.0)


def latency_words(spec: PortSpec, seconds: float) -> str:
    """What the page and the check say of it; nothing of a board's own clock."""
    if spec.latency is not None:
        return f"latency {1e3 * seconds:.0f} ms as given"
    if seconds == 0.0:
        return ""
    return f"latency about {1e3 * seconds:.0f} ms, give latency_ms if you know it"


def stamp_doubt(spec: PortSpec) -> float:
    """[s] 1 sigma of the stamps of what a port says; where its format is not known yet, of the
    worst that it can be: one without a clock names no sensor, and needs to be given one."""
    if spec.latency is not None:
        return TOLD
    named = FORMATS[spec.format].named if spec.format else len(spec.sensors) != 1
    return CLOCKED if named else ESTIMATED


def with_stamp_doubt(time: Array, specs: Sequence[PortSpec]) -> Array:
    """(K,) [s] `time` of each sensor, replaced where a port claims it, or may speak for any."""
    out = time.copy()
    for spec in sorted(specs, key=lambda s: len(s.sensors) > 0):
        out[list(spec.sensors) if spec.sensors else slice(None)] = stamp_doubt(spec)
    return np.asarray(out)
