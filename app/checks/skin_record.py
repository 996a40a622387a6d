"""A real skin's bytes into a file, for `flinch record-skin`."""

from collections.abc import Callable
from pathlib import Path

from app.errors import SensorError
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.capture import CaptureWriter
from app.sensing.open_ports import AUTO, open_skin
from app.timing import Clock

LOOK = 0.01  # [s] between two looks at the ports


def record_skin(
    text: str,
    file: Path,
    robot: Robot,
    skin: Skin,
    clock: Clock,
    ready: Callable[[str], None],
    over: Callable[[], bool],
) -> tuple[int, tuple[tuple[str, str], ...]]:
    """Record the ports that `text` names, as after `serial:`, until `over`.

    Returns how many bytes came, and how each port is, in words. `ready` is told once with a
    sentence when it has begun. Raises `SensorError` where nothing came: there is no file then.
    """
    source = open_skin(text, skin, clock)
    try:
        posture = robot.posture(robot.home)
        writer = CaptureWriter(file, entries(text, source.ports), clock)
        try:
            source.overhear(writer.put)
            ready(f"recording {', '.join(source.ports)} into {file}")
            while not over():
                source.poll(clock.now(), posture)
                clock.sleep_until(clock.now() + LOOK)
            source.poll(clock.now(), posture)
        finally:
            writer.close()
        states = source.inputs(clock.now())
    finally:
        source.close()
    if not writer.bytes:
        file.unlink()
        said = "; ".join(f"{name} is {words}" for name, words in states)
        raise SensorError(f"nothing came, so there is no {file}: {said}; is it the right port?")
    return writer.bytes, states


def entries(text: str, ports: tuple[str, ...]) -> list[str]:
    """One entry a port, as `serial:` takes it; `auto` is what was found."""
    if text.strip().startswith(AUTO):
        return [port + text.strip().removeprefix(AUTO) for port in ports]
    return [entry.strip() for entry in text.split(",")]
