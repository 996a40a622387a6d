"""A guest's `act` as one of the controllers: checked, cut to the limits, and named where it fails.

Whatever a guest asks for goes the way of the paper's controllers: cut to the limits of position,
velocity and acceleration, kept out of the known cell, slowed before unseen space.
"""

import traceback
from collections.abc import Callable
from typing import Any

import numpy as np

from app.control.controller import Situation
from app.control.guests.arm import Arm
from app.control.guests.frames import frames_of
from app.control.limits import bring_into, velocity_box
from app.control.wish import goal_ahead
from app.errors import FlinchError
from app.messages import Array, Command, JointState, SensorFrame, freeze
from app.robot.model import Robot


class Guest:
    """Who is asked. It can be called, so that a brain's state leaves it alone: nobody knows what
    is in a guest, and a replay that begins in the middle begins with a new one.

    make: makes the guest of the arm, at the first tick.
    """

    def __init__(self, name: str, robot: Robot, make: Callable[[Arm], Any]) -> None:
        self._name, self._make, self._arm = name, make, Arm(robot)
        self._mine: Any = None
        self._newest: dict[int, SensorFrame] = {}
        self.anew = False  # is it to forget what came before?

    def __call__(self, now: Situation) -> tuple[Array, int]:
        """The velocity (n,) that it asks for, and the row of the pairs that it says to act on.

        FlinchError that names the guest where it fails.
        """
        self._newest.update((f.sensor, f) for f in now.frames)
        frames, arm = frames_of(now, self._newest), self._arm
        arm.dt, arm.params, arm.share, arm.applied = now.dt, now.params, now.share, now.applied
        aim = goal_ahead(now.wish, now.posture) if now.wish else now.goal
        goal = None if aim is None else aim.T_base_tool.copy()
        joints = JointState(now.joints.stamp, now.joints.q.copy(), now.joints.qd.copy())
        doing = "__init__"
        try:
            if self._mine is None:
                self._mine = self._make(arm)
            elif self.anew and hasattr(self._mine, "reset"):
                doing = "reset"
                self._mine.reset()
            self.anew, doing = False, "act"
            asked = self._mine.act(frames, joints, goal)
        except (Exception, SystemExit) as error:
            at = traceback.extract_tb(error.__traceback__)[-1]
            where = f"line {at.lineno} of {at.filename.rpartition('/')[2]}"
            raise FlinchError(f"{self._name}: {doing} raised {error!r}, {where}") from error
        row = getattr(self._mine, "row", -1)
        told = isinstance(row, int | np.integer) and 0 <= row < len(frames.near.row)
        return self._checked(asked), int(frames.near.row[row]) if told else -1

    def _checked(self, asked: Any) -> Array:
        n = self._arm.n
        try:
            qd = np.array(asked, dtype=np.float64)
        except (TypeError, ValueError) as e:
            raise FlinchError(
                f"{self._name}: act gave a {type(asked).__name__}; give {n} joint velocities"
            ) from e
        if qd.shape != (n,):
            raise FlinchError(
                f"{self._name}: act gave the shape {qd.shape}; give {n} joint velocities, ({n},)"
            )
        if not np.isfinite(qd).all():
            raise FlinchError(f"{self._name}: act gave {qd.tolist()}; give finite velocities")
        return qd


class GuestController:
    """One of the controllers, whoever wrote it."""

    def __init__(self, robot: Robot, name: str, make: Callable[[Arm], Any]) -> None:
        self._robot, self._guest = robot, Guest(name, robot, make)

    def reset(self) -> None:
        """The guest's own `reset` is called before its next `act`, if it has one."""
        self._guest.anew = True

    def update(self, now: Situation) -> Command:
        """What the guest asks for, as far as the limits allow; `progress` is the share left."""
        asked, row = self._guest(now)
        speed = now.params.joint_speed * now.share
        box = velocity_box(self._robot, now.joints.q, speed, now.dt, now.applied)
        qd, _ = bring_into(asked, now.applied, box)
        size = float(np.linalg.norm(asked))
        cut = min(float(np.linalg.norm(qd - asked)) / size, 1.0) if size > 0.0 else 0.0
        return Command(freeze(qd), activation=float(row >= 0), progress=1.0 - cut, control_row=row)
