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
from dataclasses import replace

from app.messages import freeze
from app.robot.sensor_type import SensorType
from app.robot.skin import Skin
from app.sensing.port_spec import PortSpec
from app.sensing.wire.detect import format_of

BITS = 10  # of a byte on the line
NO_LINE = "/dev/ttyACM"  # boards with USB of their own: their speed is a name, nothing is slow
# [s], 1 sigma of a stamp: where only size and speed are known, what is left out above is spread
# over 50 ms; a latency that was measured varies with the board's polling
ESTIMATED, TOLD = 0.015, 0.005


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


def latency_words(spec: PortSpec, seconds: float, late: float) -> str:
    """What the page and the check say of it; nothing of a board's own clock alone.

    late: [s] what the calibration of the mounts found stamps to be later by than this says.
    """
    more = f", and {1e3 * late:+.0f} ms by the mounts' calibration" if late else ""
    if spec.latency is not None:
        return f"latency {1e3 * seconds:.0f} ms as given{more}"
    if seconds == 0.0:
        return f"latency{more[5:]}" if more else ""
    hint = "" if more else ", give latency_ms if you know it"
    return f"latency about {1e3 * seconds:.0f} ms{more}{hint}"


def clockless(spec: PortSpec) -> bool:
    """May what a port says be without a clock? Such formats name no sensor either, so where the
    format is not known yet, a port that is given no sensor, or several, has one."""
    if not spec.format:
        return len(spec.sensors) == 1
    told = format_of(spec.format)
    return not told.named or bool(told.sensors)


def with_stamp_doubt(skin: Skin, specs: Sequence[PortSpec]) -> Skin:
    """The skin with what is not known of the stamps of frames without a clock on these ports."""
    time = skin.doubt.time.copy()
    for spec in specs:
        if clockless(spec):
            time[list(spec.sensors)] = ESTIMATED if spec.latency is None else TOLD
    return replace(skin, doubt=replace(skin.doubt, time=freeze(time)))
