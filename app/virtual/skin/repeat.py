"""A captured port spoken again, byte for byte and at its own times."""

from collections.abc import Callable

from app.errors import SensorError
from app.robot.skin import Skin
from app.sensing.captured import Capture, Tape
from app.timing import Clock
from app.virtual.skin.pty_port import PtyPort

LOOK = 2e-3  # [s] at most between two looks at what is due


class Mouth:
    """Says what is heard."""

    def __init__(self, port: PtyPort) -> None:
        self.said = 0
        self._port = port

    def hear(self, stream: int, baud: int, chunk: bytes, now: float) -> None:
        self.said += 1
        self._port.write(chunk)


def repeat(
    capture: Capture,
    skin: Skin,
    port: PtyPort,
    clock: Clock,
    seconds: float,
    over: Callable[[], bool],
) -> tuple[int, int]:
    """Once, from when somebody listens, or until `over` or `seconds` (0: as long as it is).

    Returns reads said again and those lost.
    """
    if not capture.single:
        raise SensorError(f"{capture.path}: holds several ports; a virtual one repeats one")
    mouth = Mouth(port)
    tape = Tape(capture.path, {capture.specs(skin)[0].port: mouth})
    end = clock.now() + seconds if seconds else float("inf")
    try:
        while not (tape.over or over() or clock.now() >= end):
            if port.heard:
                tape.play(clock.now())
                port.write(b"")  # what did not fit before
            clock.sleep_until(clock.now() + LOOK)
    finally:
        tape.close()
    return mouth.said, port.lost
