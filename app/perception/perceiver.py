"""What a brain asks of whoever perceives for it.

There is one `Perception`; a study may give a brain another one that knows the truth.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import Learned
from app.config import Params
from app.messages import JointState, SensorFrame
from app.needs import Needs
from app.perception.background import Background
from app.perception.perception import Lap, Percept
from app.robot.posture import Posture


class Perceiver(Protocol):
    """See `app.perception.perception.Perception`."""

    @property
    def background(self) -> Background: ...
    @property
    def unable(self) -> NDArray[np.uint8]: ...

    def know(self, learned: Learned) -> None: ...
    def reset(self) -> None: ...
    def begin_anew(self) -> None: ...
    def update(
        self,
        frames: Sequence[SensorFrame],
        joints: JointState,
        posture: Posture,
        params: Params,
        needs: Needs,
        dt: float,
        lap: Lap,
    ) -> Percept: ...
    def recall(self, joints: JointState, params: Params) -> Percept: ...
