"""A ghost: a second brain on a simulated plant of its own, in the same world, at the same time.

It hears the same people and follows the arm's mode, and touches nothing: two controllers can
be watched side by side. It doubles what the simulation and the tick cost. A ghost that fails
is left out with its reason; the arm goes on.
"""

import logging
from dataclasses import replace

import numpy as np

from app.actions import OF_THE_PLANT, Action, SetMode, SetParams
from app.brain import Brain
from app.messages import GhostState, Mode
from app.plant.plant import Plant
from app.tick import Inputs, Outputs

log = logging.getLogger(__name__)


class Ghost:
    """Steps with the engine, in the controller's `mode` whatever the arm's is."""

    def __init__(self, brain: Brain, plant: Plant, mode: str) -> None:
        self.fault = ""  # why it was left out; empty while it runs
        self._brain, self._plant, self._mode = brain, plant, mode
        self._status = Mode.IDLE  # its own, of the last tick

    def step(self, x: Inputs, out: Outputs) -> GhostState | None:
        """One tick beside the arm's own, which had `x` and `out`; None once it has failed."""
        if self.fault:
            return None
        try:
            return self._step(x, out)
        except Exception as error:
            log.exception("the ghost failed and is left out")
            self.fault = repr(error)
            return None

    def _step(self, x: Inputs, out: Outputs) -> GhostState:
        seen = self._plant.read(x.now, out.params.silence)
        own = replace(
            x, joints=seen.joints, applied=seen.applied, arm=seen.arm, frames=seen.frames,
            source=seen.source, actions=self._heard(x.actions, out.status.mode), refused="",
            fault="",
        )  # fmt: skip
        mine = self._brain.tick(own)
        if mine.trace:
            raise RuntimeError(mine.trace.strip().splitlines()[-1])
        self._plant.send(mine.command.qd, x.dt)
        self._status = mine.status.mode
        near = float(np.min(mine.body.distance, initial=np.inf))
        return GhostState(self._mode, mine.T_base_link, near, mine.command)

    def _heard(self, actions: tuple[Action, ...], mode: Mode) -> tuple[Action, ...]:
        """What people ask of the arm, as far as it is also asked of the ghost."""
        heard: list[Action] = []
        for action in actions:
            if isinstance(action, SetParams):
                heard.append(SetParams({k: v for k, v in action.changes.items() if k != "mode"}))
            elif not isinstance(action, (*OF_THE_PLANT, SetMode)):
                heard.append(action)
        if Mode.IDLE not in (mode, self._status) and mode is not self._status:
            heard.append(SetMode(mode, "as the arm"))
        return tuple(heard)
