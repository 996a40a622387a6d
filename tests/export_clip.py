"""A short run without an engine: the arm at home, a point that comes nearer, and a stop."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from app.messages import Command, Mode, Pairs, Snapshot, Status
from app.robot.model import Robot
from app.ui.export.film import Arm
from tests.ui_page import CELL, FakeEngine, at, body, fake_skin, snapshot

RATE = 50.0  # [Hz]


def arm_of(robot: Robot) -> Arm:
    """It wears two sensors."""
    return Arm(robot, fake_skin(robot), CELL, "A test", "nowhere")


def nearer(pairs: Pairs, distance: float) -> Pairs:
    """The same pairs, the closest one at `distance` [m]."""
    distances = pairs.distance.copy()
    distances[pairs.closest] = distance
    return replace(pairs, distance=distances)


def run(arm: Arm, seconds: float = 1.0, least_at: float = 0.5) -> Iterator[Snapshot]:
    """The last joint turns; 8 cm at `least_at` [s], where no picture need be; stopped after 0.8 s.

    Two poses of the body `Box` stand for a simulated world.
    """
    engine = FakeEngine(arm.robot, arm.skin)
    first = snapshot(engine)
    box = body("Box")
    for k in range(round(RATE * seconds)):
        t = k / RATE
        q = arm.robot.home + np.array([0.4, 0.0, 0.0, 0.0, 0.0, 1.0]) * t
        posture = arm.robot.posture(q)
        status = Status(Mode.RUNNING, "", 0.0)
        if t >= 0.8:
            status = Status(Mode.STOPPED, "lost <b>port</b>", 0.0)
        pairs = nearer(first.pairs, 0.08 if abs(t - least_at) < 1e-9 else 0.30)
        yield replace(
            first,
            tick=k,
            stamp=first.stamp + t,
            T_base_link=posture.T_base_link,
            T_base_tool=posture.T_base_tool,
            pairs=pairs,
            body=pairs,
            world=(at(box, [0.9, 0.3, 0.3 + 0.1 * t]),),
            command=Command(np.zeros(6), activation=0.25),
            status=status,
        )
