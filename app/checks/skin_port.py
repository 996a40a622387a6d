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

LOOK = 0.02  # [s] between two looks at the port
PROMPTS = {
    "wall": ("hold a flat wall before {name}, still",),
    "hand": (
        "move a hand once from left to right, as {name} sees it",
        "now once from top to bottom",
    ),
}


def record_port(
    text: str,
    robot: Robot,
    skin: Skin,
    what: str,
    clock: Clock,
    prompt: Callable[[str], None],
    seconds: float = 4.0,
) -> tuple[int, Array, str]:
    """The sensor that `text` names, its reports (F, n) [m], NaN where nothing is seen, and what
    its port is like, in words.

    `prompt` gets a sentence for the person before each part, which lasts `seconds`.
    """
    specs = parse_ports(text, skin)
    if len(specs) != 1 or len(specs[0].sensors) != 1 or specs[0].port == AUTO:
        raise SensorError(f"sensors = 'serial:{text}'; name one port and one sensor, PORT=SENSOR")
    (k,) = specs[0].sensors
    source = open_skin(text, skin, clock)
    posture = robot.posture(robot.home)
    depth: list[Array] = []
    try:
        for sentence in PROMPTS[what]:
            prompt(f"{sentence.format(name=skin.sensors[k].name)} ({seconds:g} s)")
            end = clock.now() + seconds
            while clock.now() < end:
                for f in source.poll(clock.now(), posture):
                    if f.sensor == k:
                        depth.append(skin.believed(k, f.distance, f.status, f.targets))
                clock.sleep_until(clock.now() + LOOK)
        words = dict(source.inputs(clock.now()))[specs[0].port]
    finally:
        source.close()
    if not depth:
        raise SensorError(f"{skin.sensors[k].name} has said nothing; its port is {words}")
    return k, np.array(depth), words
