"""`serial:` and what may follow it: ports, their speed, their format, their sensors.

    PORT[@BAUD][#FORMAT][=SENSORS][:latency_ms=MS]       several of them separated by commas

FORMAT is a name, or a file that describes what a sketch prints (`mine.toml`).
PORT is a device, `socket://HOST:PORT` or `rfc2217://HOST:PORT` of a bridge, or `auto` for every USB
port that speaks a known format.
SENSORS is a sensor's name, or a ring's for all of its sensors. A port whose format names no
sensor needs one; for one whose format does, it is a promise that is held against its frames.
MS are the milliseconds from the middle of a measurement to its arrival, or to the board's own
stamp where its format has one; left away they are estimated, see `app.sensing.latency`.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from app.errors import SensorError, options
from app.paths import cut_path, entries
from app.robot.skin import Skin
from app.sensing.line import BRIDGE, SOCKET
from app.sensing.wire.detect import format_of
from app.sensing.wire.raw import USUAL, Grid

SYNTAX = "PORT[@BAUD][#FORMAT][=SENSORS][:latency_ms=MS]"
SPEC = re.compile(
    r"(?P<port>[^=]+?)(?:@(?P<baud>\d+))?(?:#(?P<format>[^=#]*?))?(?:=(?P<names>.*?))?"
    r"(?::latency_ms=(?P<latency>.*))?"
)
BRIDGES = (SOCKET, BRIDGE)
SLOWEST, FASTEST = 9600, 12_000_000  # [baud]
LATEST = 150.0  # [ms] later frames are soon too old to be of use: three periods of most sensors


@dataclass(frozen=True, slots=True)
class PortSpec:
    """One port: baud 0 and an empty format are found out; no sensors: as the frames say.

    grids: of zones that its sensors have, the likeliest first.
    latency: [s] as given; None: it is estimated.
    meant: sensors that the format's own numbers mean; empty: the layout's numbers.
    """

    port: str
    baud: int = 0
    format: str = ""
    sensors: tuple[int, ...] = ()
    grids: tuple[Grid, ...] = USUAL
    latency: float | None = None
    meant: tuple[int, ...] = ()


def parse_ports(text: str, skin: Skin) -> tuple[PortSpec, ...]:
    """Ports of the part after `serial:`; a `SensorError` names the entry and the remedy."""
    specs = tuple(_one(entry.strip(), skin) for entry in entries(text))
    names = [s.port for s in specs]
    for s in specs:
        if names.count(s.port) > 1:
            raise SensorError(f"serial port {s.port} is given twice; give every port once")
    for a in range(len(specs)):
        for b in range(a + 1, len(specs)):
            both = set(specs[a].sensors) & set(specs[b].sensors)
            if both:
                raise SensorError(
                    f"serial ports {names[a]} and {names[b]} both claim "
                    f"{skin.sensors[min(both)].name}; give every sensor one port"
                )
    return specs


def _one(entry: str, skin: Skin) -> PortSpec:
    port, rest = cut_path(entry, "@#=:")
    match = SPEC.fullmatch("-" + rest) if port and Path(port).exists() else SPEC.fullmatch(entry)
    port = port if match and match["port"] == "-" else match["port"] if match else ""
    if not match:
        raise SensorError(f"serial port {entry!r} is not understood; give {SYNTAX}")
    if "://" in port and not port.startswith(BRIDGES):
        raise SensorError(
            f"serial port {port!r}: no such address is read; give a device, socket://HOST:PORT or "
            "rfc2217://HOST:PORT"
        )
    baud = int(match["baud"] or 0)
    if match["baud"] and not SLOWEST <= baud <= FASTEST:
        raise SensorError(
            f"serial port {entry!r}: {baud} baud; give {SLOWEST} to {FASTEST}, or leave it out"
        )
    told = () if match["format"] is None else format_of(match["format"]).sensors
    meant = tuple(named_sensors(name, skin)[0] for name in told)
    sensors = meant if match["names"] is None else named_sensors(match["names"], skin)
    speaking = [skin.sensors[k] for k in sensors] or list(skin.sensors)
    grids = dict.fromkeys((*(s.type.grid for s in speaking), *USUAL))
    latency = None if match["latency"] is None else _seconds(match["latency"], entry)
    return PortSpec(port, baud, match["format"] or "", sensors, tuple(grids), latency, meant)


def _seconds(text: str, entry: str) -> float:
    """A latency [s] from its milliseconds."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0.0 <= value <= LATEST:
        raise SensorError(
            f"serial port {entry!r}: latency_ms = {text}; give 0 to {LATEST:g} ms, or leave it out"
        )
    return value * 1e-3


def named_sensors(name: str, skin: Skin) -> tuple[int, ...]:
    """Indices of a sensor's name, or of all sensors of a ring's."""
    names = [s.name for s in skin.sensors]
    if name in names:
        return (names.index(name),)
    ring = tuple(i for i, n in enumerate(names) if re.fullmatch(re.escape(name) + r"-\d+", n))
    if not ring:
        known = names + sorted({n.rsplit("-", 1)[0] for n in names})
        raise SensorError(
            f"skin {skin.title!r} has no sensor or ring {name!r}; {options(name, known)}"
        )
    return ring
