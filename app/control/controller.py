"""What a controller is: a situation in, a command out."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from app.config import Params
from app.granted import Wish
from app.messages import Array, Cloud, Command, Goal, JointState, Pairs, SensorFrame
from app.robot.posture import Posture


class Situation(NamedTuple):
    """All that a controller is told in one tick.

    posture: at `joints.q`.   goal: None means: rest where you are, but give way.
    pairs:   the near pairs, of the kind that the controller needs.
    dt:      [s] that the command will hold.   share: 0..1 of the allowed speed.
    applied: (n,) [rad/s] what the arm was really told in the last tick; a command goes on from it.
    frames:  believed ones that came in this tick.   cloud: every zone with its verdict.
    memory:  (n, 3) [m] remembered points near the arm, base frame.
    wish:    a velocity that is asked for and goes before the goal; None without one.
    """

    posture: Posture
    joints: JointState
    pairs: Pairs
    goal: Goal | None
    params: Params
    dt: float
    share: float
    applied: Array
    frames: Sequence[SensorFrame] = ()
    cloud: Cloud | None = None
    memory: Array | None = None
    wish: Wish | None = None


class Controller(Protocol):
    """Turns situations into joint velocities that keep every limit of the robot."""

    def update(self, now: Situation) -> Command:
        """The next command; its `control_row` is a row of the situation's pairs.

        Raises a FlinchError, which stops the arm, where it has no answer.
        """
        ...

    def reset(self) -> None:
        """Forget what came before: another controller was in force, or the arm has braked."""
        ...
