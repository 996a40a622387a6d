"""Another controller, or other settings, on the same frames: an open loop.

In each tick the other brain gets the recorded frames and the posture that they were measured from,
and goes on from its own last command: had it been given the recorded velocity, the limits of
acceleration would have let it say little else. So it answers what it would have had the arm do
*there*; it never gets anywhere by itself, and no frame was measured from where it would be. How
close it would come is looked at over a short while only: the body is carried on with the constant
command for `HORIZON`, and its distance taken to the points that were known at that tick. The
recorded command is treated alike, so that the two can be compared; neither is what happened.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from app.actions import Action, SetParams
from app.brain import Brain
from app.config import change
from app.messages import Array, GhostState, Verdict
from app.perception.proximity import BodyPairs
from app.robot.model import Robot
from app.state import State
from app.tick import Inputs, Outputs

Loop = tuple[State, Array | None]
HORIZON = 0.5  # [s] that a command is carried on: an arm's way before the next frames tell of it


class OpenLoop:
    """The other brain; `name` is what it is called beside the recorded one."""

    def __init__(self, brain: Brain, changes: Mapping[str, Any]) -> None:
        """brain: like the recorded one, at the same tick; ConfigError for a bad setting."""
        self.brain, self._changes = brain, dict(changes)
        brain.wishes.params = change(brain.wishes.params, self._changes)
        rest = (f"{k} {v}" for k, v in self._changes.items() if k != "mode")
        self.name = ", ".join((brain.wishes.params.mode, *rest))
        self.ahead = Ahead(brain.robot)
        self._last: Array | None = None  # [rad/s] what it commanded in the last tick

    def capture(self) -> Loop:
        """All that changes from tick to tick."""
        return self.brain.capture(), self._last

    def restore(self, loop: Loop) -> None:
        """Go on from what was captured."""
        state, self._last = loop
        self.brain.restore(state)

    def tick(self, x: Inputs, out: Outputs) -> GhostState:
        """What it would tell the arm; its links where that would bring them within `HORIZON`.

        The distance is that of now: who needs the coming one asks `ahead`.
        """
        own = replace(x, actions=self._heard(x.actions))
        if self._last is not None and x.arm.ready:
            own = replace(own, joints=replace(x.joints, qd=self._last), applied=self._last)
        mine = self.brain.tick(own)
        self._last = mine.command.qd
        posture = mine.T_base_link
        if np.isfinite(x.joints.q).all():
            posture = self.ahead.posture(x.joints.q, mine.command.qd)
        near = float(np.min(mine.body.distance, initial=np.inf))
        return GhostState(self.name, posture, near, mine.command)

    def _heard(self, actions: tuple[Action, ...]) -> tuple[Action, ...]:
        """What people asked for, but for settings that are the ghost's own."""
        return tuple(
            SetParams({k: v for k, v in a.changes.items() if k not in self._changes})
            if isinstance(a, SetParams)
            else a
            for a in actions
        )


class Ahead:
    """Where a constant command carries the body, and how close to what is known it comes."""

    def __init__(self, robot: Robot) -> None:
        self._robot, self._pairs = robot, BodyPairs(robot)

    def posture(self, q: Array, qd: Array) -> Array:
        """(L, 4, 4) poses of the links after `HORIZON` at `qd` (n,) [rad/s] from `q` (n,)."""
        return self._robot.posture(self._carried(q, qd)).T_base_link

    def distance(self, q: Array, qd: Array, out: Outputs) -> float:
        """[m] smallest distance then of what can move to the points known now; inf if none is, and
        where the arm does not say where it stands."""
        if not np.isfinite(q).all():
            return float(np.inf)
        points = np.concatenate([out.cloud.points, out.memory])
        use = np.ones(len(points), dtype=bool)
        use[: len(out.cloud.points)] = out.cloud.verdict == Verdict.KEPT
        return self._pairs.search(points, use, self._robot.posture(self._carried(q, qd))).minimum

    def _carried(self, q: Array, qd: Array) -> Array:
        carried: Array = np.clip(q + HORIZON * qd, self._robot.q_min, self._robot.q_max)
        return carried
