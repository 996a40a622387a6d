"""An ablation: of each link only the closest pair, for a controller that wants several."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import Learned
from app.cell.parts import Cell
from app.config import Params
from app.messages import JointState, SensorFrame
from app.needs import Needs
from app.perception.background import Background
from app.perception.perception import Lap, Percept, Perception
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.world.world import World


class OnePairALink:
    """A perception that says less than it is asked for."""

    def __init__(self, robot: Robot, skin: Skin, world: World, cell: Cell) -> None:
        """world: is not looked at."""
        self._inner = Perception(robot, skin, cell)

    @property
    def background(self) -> Background:
        return self._inner.background

    @property
    def unable(self) -> NDArray[np.uint8]:
        return self._inner.unable

    def know(self, learned: Learned) -> None:
        self._inner.know(learned)

    def reset(self) -> None:
        self._inner.reset()

    def begin_anew(self) -> None:
        self._inner.begin_anew()

    def update(
        self, frames: Sequence[SensorFrame], joints: JointState, posture: Posture, params: Params,
        needs: Needs, dt: float, lap: Lap,
    ) -> Percept:  # fmt: skip
        """As of a perception, with one pair a link."""
        needs = replace(needs, pairs="links")
        return self._inner.update(frames, joints, posture, params, needs, dt, lap)

    def recall(self, joints: JointState, params: Params) -> Percept:
        return self._inner.recall(joints, params)
