"""The arm that a virtual skin is mounted on: at rest, or where a UR on the network says it is."""

from typing import Protocol

import numpy as np

from app.errors import SensorError
from app.messages import Array
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.ur.stream import Stream


class Wearer(Protocol):
    """Where the skin's arm is."""

    def posture(self, now: float) -> Posture:
        """At `now` [s]."""
        ...

    def close(self) -> None:
        """Follow nobody any more."""
        ...


class AtRest:
    """An arm that stands still at q (n,)."""

    def __init__(self, robot: Robot, q: Array) -> None:
        self._posture = robot.posture(q)

    def posture(self, now: float) -> Posture:
        return self._posture

    def close(self) -> None:
        """There is nothing to end."""


class FollowsUr:
    """The arm of a UR, from the joint angles that it tells 500 times a second; nothing is sent.

    While its link is lost the arm stays where it was, as a skin on a stopped arm would.
    """

    def __init__(self, robot: Robot, host: str) -> None:
        if robot.n != 6:
            raise SensorError(f"{robot.name} has {robot.n} joints, a UR six; leave --follow out")
        self._robot, self._stream = robot, Stream(host)

    def posture(self, now: float) -> Posture:
        return self._robot.posture(np.array(self._stream.state(now).q))

    def close(self) -> None:
        self._stream.close()


def wearer(follow: str, robot: Robot, rest: Array) -> Wearer:
    """What `--follow` means: 'ur:HOST', or at `rest` (n,) where it is empty."""
    if not follow:
        return AtRest(robot, rest)
    kind, _, host = follow.partition(":")
    if kind != "ur" or not host or ":" in host:
        raise SensorError(f"follow = {follow!r}; give 'ur:HOST' (a UR's ports are fixed)")
    return FollowsUr(robot, host)
