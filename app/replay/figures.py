"""The figures of a moment that plots and tables are made of."""

from typing import NamedTuple

import numpy as np

from app.control.registry import kind_of
from app.replay.open_loop import Ahead
from app.replay.timeline import Moment
from app.robot.model import Robot


class Figures(NamedTuple):
    """Distances in metres, speeds in rad/s; NaN of what there is not.

    distance:   the smallest that the controller looked at.   body: of all that can move.
    kept, begins: which distance the controller keeps, and from which on it acts.
    protective: what speed and separation asked for.   activation: 0..1 of the avoidance.
    ahead:      smallest distance if the command went on for `open_loop.HORIZON`.
    speed:      norm of the command.
    ghost_*:    the same of the ghost; `ghost_apart` is the norm of the difference of commands.
    """

    distance: float
    body: float
    kept: float
    begins: float
    protective: float
    activation: float
    ahead: float
    speed: float
    ghost_ahead: float
    ghost_speed: float
    ghost_apart: float
    ghost_activation: float


class Figurer:
    """Makes them for one robot."""

    def __init__(self, robot: Robot) -> None:
        self._ahead = Ahead(robot)

    def row(self, moment: Moment) -> Figures:
        """The figures of a moment."""
        x, out, ghost = moment
        distances = kind_of(out.params.mode).distances(out.params)
        kept, begins = (np.nan, np.nan) if distances is None else distances
        qd = out.command.qd
        ghostly = (np.nan,) * 4
        if ghost is not None:
            other = ghost.command
            ghostly = (
                self._ahead.distance(x.joints.q, other.qd, out), norm(other.qd),
                norm(other.qd - qd), other.activation,
            )  # fmt: skip
        return Figures(
            out.pairs.minimum, out.body.minimum, float(kept), float(begins),
            out.command.protective or np.nan, out.command.activation,
            self._ahead.distance(x.joints.q, qd, out), norm(qd), *ghostly,
        )  # fmt: skip


def norm(v: np.ndarray) -> float:
    """Euclidean."""
    return float(np.linalg.norm(v))
