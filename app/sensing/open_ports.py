"""From the words after `serial:` to a skin that listens; `auto` looks at every USB port."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from serial.tools import list_ports

from app.errors import SensorError
from app.robot.skin import Skin
from app.sensing.port import BAUDS, TRIAL, Port
from app.sensing.port_spec import PortSpec, parse_ports
from app.sensing.serial_skin import SerialSkin
from app.timing import Clock

AUTO = "auto"
LISTEN = TRIAL * (len(BAUDS) + 0.5)  # [s] long enough for every speed
LOOK = 0.05  # [s] between two looks at the ports that are tried


def usb_ports() -> list[str]:
    """Devices of the serial ports on USB."""
    return sorted(p.device for p in list_ports.comports() if p.vid is not None)


def open_skin(
    text: str, skin: Skin, clock: Clock, candidates: Callable[[], Sequence[str]] = usb_ports
) -> SerialSkin:
    """A skin on the ports that `text` names; a `SensorError` where one cannot be opened."""
    specs = parse_ports(text, skin)
    if any(s.port == AUTO for s in specs):
        if len(specs) > 1:
            raise SensorError("serial:auto looks at every port; name no other beside it")
        return _find(specs[0], skin, clock, candidates())
    ports: list[Port] = []
    try:
        for spec in specs:
            ports.append(Port(spec, clock))
    except SensorError:
        _close(ports)
        raise
    return SerialSkin(skin, ports, specs)


def _find(spec: PortSpec, skin: Skin, clock: Clock, names: Sequence[str]) -> SerialSkin:
    """Listen at all of `names` until each has spoken or time is up; keep those that have."""
    ports: list[Port] = []
    refused = []
    for name in names:
        try:
            ports.append(Port(replace(spec, port=name), clock))
        except SensorError as error:
            refused.append(str(error))
    end = clock.now() + LISTEN
    while clock.now() < end and not all(p.facts().frames for p in ports):
        clock.sleep_until(clock.now() + LOOK)
        for port in ports:
            port.receive()
    speaking = [p for p in ports if p.facts().frames]
    why = [f"{p.name}: {p.facts().trouble}" for p in ports if p.facts().trouble]
    _close([p for p in ports if p not in speaking])
    if not speaking and why:
        raise SensorError(f"no skin found on a USB serial port: {'; '.join(why)}")
    if not speaking:
        tried = f"none of {', '.join(names)} speaks a known format" if names else "there is none"
        raise SensorError(f"no skin found on a USB serial port: {tried}; name one as serial:PORT")
    if spec.sensors and len(speaking) > 1:
        _close(speaking)
        both = ", ".join(p.name for p in speaking)
        raise SensorError(f"{both} speak, and serial:auto=SENSORS is for one; name each port")
    return SerialSkin(skin, speaking, [replace(spec, port=p.name) for p in speaking])


def _close(ports: Sequence[Port]) -> None:
    for port in ports:
        port.close()
