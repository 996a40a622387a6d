"""A wish that a person keeps alive: with the last message it fades, and the arm comes to rest.

Nobody can forget to end it: `LAPSE` seconds after the last message, by the tick's clock, nothing
is wished for any more, whatever became of the key, the page, or the network between.
"""

from typing import NamedTuple

import numpy as np

from app.actions import Jog, JogJoints, Want
from app.config import Params
from app.control.goals import goal_twist
from app.granted import Wish
from app.messages import Array, JointState, freeze
from app.robot.model import Robot
from app.robot.posture import Posture, rigid

LAPSE = 0.25  # [s] five messages of a held button; some may be late
RAMP = 0.15  # [s] from rest to the whole of what is asked for, and back: no jolt
STILL = 0.01  # [rad/s] an arm whose joints are all slower has come to rest
SETTLE = 1.0  # [s] after which it is told to hold though it is pushed about
HOMING = 2.0  # [1/s] of the joints' way home
HOME = 2e-3  # [rad or m] near enough


class Speeds(NamedTuple):
    """(n,) what each joint may do, and [m/s], [rad/s] what the tool may."""

    joint: Array
    tool: float
    turn: float


class Jogging:
    """What is asked for now; nothing at first."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.reset()

    def reset(self) -> None:
        """Nobody asks for anything."""
        self._asked: Jog | JogJoints | Want | None = None
        self._target: Array = np.zeros(0)  # shares that are asked for
        self._share: Array = np.zeros(0)  # and those that they have grown to
        self._until, self._rests = -np.inf, np.inf

    @property
    def active(self) -> bool:
        """Does anybody ask, or is the arm still coming to rest after it?"""
        return self._asked is not None

    def ask(self, action: Jog | JogJoints | Want, now: float) -> None:
        """From now on this; ValueError for what is no wish for this arm, and nothing changes."""
        target = np.ones(1) if isinstance(action, Want) else np.array(action.share, dtype=float)
        if isinstance(action, Jog | JogJoints):
            self._check(action, target)
            target = np.clip(target, -1.0, 1.0)
        else:
            _check_want(action, self._robot.n)
        if not target.any():
            self._until = now  # let go
            return
        if type(action) is not type(self._asked) or len(target) != len(self._share):
            self._share = np.zeros(len(target))
        self._asked, self._target = action, target
        self._until, self._rests = now + LAPSE, np.inf

    def update(
        self, now: float, dt: float, posture: Posture, joints: JointState, params: Params
    ) -> Wish | None:
        """The velocity for the next `dt` [s]; None once the arm has come to rest."""
        asked = self._asked
        if asked is None:
            return None
        over = now >= self._until
        if isinstance(asked, Want):
            self._share = np.zeros(1) if over else np.ones(1)
        else:
            target = np.zeros(len(self._share)) if over else self._target
            self._share = self._share + np.clip(target - self._share, -dt / RAMP, dt / RAMP)
        if over and not self._share.any():
            self._rests = min(self._rests, now)
            if np.abs(joints.qd).max() < STILL or now - self._rests > SETTLE:
                self.reset()
                return None
        return self._wish(asked, posture, params)

    def _wish(self, asked: Jog | JogJoints | Want, posture: Posture, params: Params) -> Wish:
        if isinstance(asked, Want):
            return _wanted(asked, float(self._share[0]), posture, params)
        speeds = speeds_of(self._robot, params)
        if isinstance(asked, JogJoints):
            return Wish(qd=freeze(within(self._share * speeds.joint, posture, speeds)))
        R = posture.T_base_tool[:3, :3] if asked.R_base_axes is None else asked.R_base_axes
        linear, turning = (shortened(R @ part) for part in (self._share[:3], self._share[3:]))
        return Wish(twist=freeze(np.concatenate((linear * speeds.tool, turning * speeds.turn))))

    def _check(self, action: Jog | JogJoints, share: Array) -> None:
        n = 6 if isinstance(action, Jog) else self._robot.n
        if share.shape != (n,) or not np.isfinite(share).all():
            raise ValueError(f"{n} finite shares are needed to move the arm so")
        if isinstance(action, Jog) and action.R_base_axes is not None:
            R = np.asarray(action.R_base_axes)
            if R.shape != (3, 3) or not np.allclose(R @ R.T, np.eye(3), atol=1e-6):
                raise ValueError("the axes to move along must be a rotation, (3, 3)")


def speeds_of(robot: Robot, params: Params) -> Speeds:
    """How fast the settings let a person move the arm: no faster than it goes to a goal."""
    joint = np.minimum(params.joint_speed * robot.qd_max, params.goal_turning)
    return Speeds(joint, params.goal_speed, params.goal_turning)


def within(qd: Array, posture: Posture, speeds: Speeds) -> Array:
    """Joint velocities (n,), shortened as a whole until the tool keeps its speeds."""
    twist = posture.tool_jacobian() @ qd
    of_tool = float(np.linalg.norm(twist[:3])) / speeds.tool
    return qd / max(of_tool, float((np.abs(qd) / speeds.joint).max()), 1.0)


def shortened(v: Array) -> Array:
    """A vector no longer than 1: a corner is no faster than a side."""
    return v / max(float(np.linalg.norm(v)), 1.0)


def homeward(robot: Robot, posture: Posture, params: Params, share: float) -> Wish | None:
    """The joints' way home at `share` of the speeds that are set; None once they are there."""
    left = robot.home - posture.q
    if np.abs(left).max() < HOME:
        return None
    return Wish(qd=freeze(share * within(HOMING * left, posture, speeds_of(robot, params))))


def _wanted(want: Want, share: float, posture: Posture, params: Params) -> Wish:
    if want.qd is not None:
        return Wish(qd=freeze(share * np.asarray(want.qd, dtype=float)))
    if want.twist is not None:
        return Wish(twist=freeze(share * np.asarray(want.twist, dtype=float)))
    T = rigid(np.asarray(want.T_base_tool))
    twist = goal_twist(posture.T_base_tool, T, params.goal_speed, params.goal_turning)
    return Wish(twist=freeze(share * twist))


def _check_want(want: Want, n: int) -> None:
    """ValueError unless one thing is wanted, of the right size, and finite."""
    given = {
        name: np.asarray(value, dtype=float)
        for name in ("T_base_tool", "twist", "qd")
        if (value := getattr(want, name)) is not None
    }
    if len(given) != 1:
        raise ValueError("one thing can be wanted: a pose, a twist or joint velocities")
    ((name, value),) = given.items()
    shape = {"T_base_tool": (4, 4), "twist": (6,), "qd": (n,)}[name]
    if value.shape != shape or not np.isfinite(value).all():
        raise ValueError(f"{name} has the shape {value.shape}; give {shape}, all finite")
