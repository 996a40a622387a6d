"""The least true distance of what three joints or more move: of links that can give way at all."""

from typing import Any

import numpy as np

from app.judge.encounter import JUDGED_EVERY
from app.judge.least import LeastDistance
from app.judge.run import distal
from app.judge.truth import TrueDistance
from app.messages import Snapshot
from app.plant.simulated import SimulatedPlant
from app.runtime import Engine


class DistalLeast:
    """A watcher; the bodies of the engine's known cell are no environment."""

    def __init__(self, engine: Engine) -> None:
        plant = engine.plant
        assert isinstance(plant, SimulatedPlant)
        robot = plant.robot
        links = np.flatnonzero(distal(robot.supports))
        truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
        names = plant.world.shapes()
        cell = [b.name for b in engine.cell.boxes if b.name in names]
        self._plant, self._judged = plant, -np.inf
        self._least = LeastDistance(truth, robot, links, plant.world, cell)

    def update(self, s: Snapshot) -> None:
        """Take note of one tick."""
        if s.stamp >= self._judged + JUDGED_EVERY:
            self._judged = s.stamp
            self._least.update(self._plant.true_poses(), s.world)

    def figures(self) -> dict[str, Any]:
        """distal_least_m: [m], 0 on contact."""
        return {"distal_least_m": max(self._least.least, 0.0)}

    def marks(self) -> list[list[Any]]:
        """Nothing but the course."""
        return []
