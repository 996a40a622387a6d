"""A real sensor shown a wall or a hand: what it says over its port, for `flinch skin check`."""

from collections.abc import Callable

import numpy as np

from app.errors import SensorError
from app.messages import Array
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.open_ports import AUTO, open_skin
from app.sensing.port_spec import parse_ports
from app.timing import Clock

TRUSTED = (5, 9)
LOOK = 0.02  # [s] between two looks at the port
PROMPTS = {
    "wall": ("hold a flat wall before {name}, still",),
    "hand": (
        "move a hand once from left to right, as {name} sees it",
        "now once from top to bottom",
    ),
}


def listen(
    text: str,
    robot: Robot,
    skin: Skin,
    what: str,
    clock: Clock,
    tell: Callable[[str], None],
    seconds: float = 4.0,
) -> tuple[int, Array]:
    """The sensor that `text` names and its depths (F, 64) [m], NaN where nothing is seen.

    `tell` gets a sentence for the person before each part, which lasts `seconds`.
    """
    specs = parse_ports(text, skin)
    if len(specs) != 1 or len(specs[0].sensors) != 1 or specs[0].port == AUTO:
        raise SensorError(f"sensors = 'serial:{text}'; name one port and one sensor, PORT=SENSOR")
    (k,) = specs[0].sensors
    source = open_skin(text, skin, clock)
    posture = robot.posture(robot.home)
    depth: list[Array] = []
    try:
        for prompt in PROMPTS[what]:
            tell(f"{prompt.format(name=skin.sensors[k].name)} ({seconds:g} s)")
            end = clock.now() + seconds
            while clock.now() < end:
                for f in source.poll(clock.now(), posture):
                    if f.sensor == k:
                        good = (f.targets > 0) & np.isin(f.status, TRUSTED)
                        depth.append(np.where(good, f.distance, np.nan))
                clock.sleep_until(clock.now() + LOOK)
        words = dict(source.inputs(clock.now()))[specs[0].port]
    finally:
        source.close()
    if not depth:
        raise SensorError(f"{skin.sensors[k].name} has said nothing; its port is {words}")
    return k, np.array(depth)
