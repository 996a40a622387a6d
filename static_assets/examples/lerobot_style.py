"""A robot of LeRobot's kind that gives way: the guard between `send_action` and the motors.

Whatever policy drives it, diffusion, ACT or a person's leader arm, sends joint positions by name.
What goes on to the motors is the nearest motion that keeps clear; as LeRobot asks, `send_action`
returns what was really sent, so that a data set records that.

    robot = GuardedRobot(SO101Follower(config), flinch.Guard.of("my_robot"), read_skin)

Limits: positions in radians and one action a step, 30 Hz or more; the arm must follow what it is
told, and the guard is no emergency stop. Nothing is imported from LeRobot: only its names are used.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

import flinch


class GuardedRobot:
    """Wraps a robot with `get_observation` and `send_action`; all else is the robot's own."""

    def __init__(
        self, robot: Any, guard: flinch.Guard,
        read_skin: Callable[[], Sequence[flinch.SensorFrame]],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        """read_skin: the frames that have come since it was asked last, stamped by `clock`."""
        self._robot, self._guard, self._read_skin, self._clock = robot, guard, read_skin, clock
        self._keys = [f"{name}.pos" for name in guard.robot.joints]
        self._before: tuple[float, np.ndarray] | None = None
        self.reason = ""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._robot, name)

    def send_action(self, action: dict[str, float]) -> dict[str, float]:
        """Send the nearest action that keeps clear; returns it. `reason` says why it differs."""
        now, seen = self._clock(), self._robot.get_observation()
        q = np.array([seen[key] for key in self._keys])
        then, old = self._before or (now - 1.0 / 30.0, q)
        dt = now - then
        wanted = (np.array([action[key] for key in self._keys]) - q) / dt
        joints = flinch.JointState(now, q, (q - old) / dt)
        command = self._guard.step(self._read_skin(), joints, flinch.JointSpeeds(wanted))
        self._before, self.reason = (now, q), command.reason
        sent = dict(zip(self._keys, (q + dt * command.qd).tolist(), strict=True))
        self._robot.send_action({**action, **sent})
        return {**action, **sent}
