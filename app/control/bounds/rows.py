"""The rows of a quadratic programme's bounds, and what is common to all kinds of them.

A row says  J qd + s >= low , where J qd is the rate of a distance and s >= 0 the slack that it
costs `linear` s + `quadratic` s^2 / 2 to take. A kind of bound appends its rows; it leaves out
those that no velocity of the step ahead breaks, since they change nothing.
"""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.control.controller import Situation
from app.control.limits import Step
from app.messages import Array
from app.robot.posture import Posture

BRAKING = 0.5  # share of the reachable acceleration in which a demand grows, and a pair is braked
EASE = 0.15  # [s] in which a retreat that is not urgent is taken up: two frames of a sensor


class Rows(NamedTuple):
    """A sheet of m bounds: jacobian (m, n), low (m,) [m/s], linear and quadratic cost of slack.

    source: (m,) row of the pairs that a bound came from, -1 for the robot itself and the cell.
    inside: (m,) bool, what is bound is nearer than it should be.
    urgent: (m,) bool, a retreat is demanded at once.
    filled: (1,) how many rows are in use.
    """

    jacobian: Array
    low: Array
    linear: Array
    quadratic: Array
    source: NDArray[np.int64]
    inside: NDArray[np.bool_]
    urgent: NDArray[np.bool_]
    filled: NDArray[np.int64]


class Bound(Protocol):
    """One kind of bounds."""

    def append(self, now: Situation, step: Step, rows: Rows) -> None:
        """Append the bounds that some velocity of the step ahead breaks."""
        ...


class Motion(NamedTuple):
    """A posture for kernels: T_base_link (L, 4, 4), J_base (6, n), supports (L, n)."""

    T_base_link: Array
    J_base: Array
    supports: Array


def empty_sheet(room: int, joints: int) -> Rows:
    """No rows yet, and room for some."""
    low, linear, quadratic = np.empty((3, room))
    inside, urgent = np.empty((2, room), np.bool_)
    return Rows(
        np.empty((room, joints)), low, linear, quadratic, np.empty(room, np.int64), inside, urgent,
        np.zeros(1, np.int64),
    )  # fmt: skip


def used(rows: Rows) -> Rows:
    """The rows that are in use."""
    return Rows._make(column[: rows.filled[0]] for column in rows)


def motion(posture: Posture) -> Motion:
    """The posture's arrays."""
    return Motion(posture.T_base_link, posture.J_base, posture.supports)


@compiled
def add_rate(link: int, at: Array, n: Array, sign: float, moves: Motion, J: Array) -> None:
    """Add to J (n,) the rate, times `sign`, of the point `at` (3,) of a link along n (3,).

    n . v = [n, at x n] J_base, restricted to the joints that move the link.
    """
    x = at[1] * n[2] - at[2] * n[1]
    y = at[2] * n[0] - at[0] * n[2]
    z = at[0] * n[1] - at[1] * n[0]
    J_base, support = moves.J_base, moves.supports[link]
    for j in range(len(J)):
        if support[j] != 0.0:
            along = n[0] * J_base[0, j] + n[1] * J_base[1, j] + n[2] * J_base[2, j]
            turn = x * J_base[3, j] + y * J_base[4, j] + z * J_base[5, j]
            J[j] += sign * support[j] * (along + turn)


@compiled
def authority(J: Array, step: Step) -> tuple[float, float]:
    """Largest speed [m/s] and wise acceleration [m/s^2] along a row, all joints together."""
    speed, acceleration = 0.0, 0.0
    for j in range(len(J)):
        speed += abs(J[j]) * step.qd_max[j]
        acceleration += BRAKING * abs(J[j]) * step.qdd_max[j]
    return speed, acceleration


@compiled
def bites(J: Array, low: float, step: Step) -> bool:
    """Does some velocity of the step break the bound?"""
    least = 0.0
    for j in range(len(J)):
        if J[j] != 0.0:
            least += J[j] * (step.low[j] if J[j] > 0.0 else step.high[j])
    return least < low


@compiled
def ease(rows: Rows, i: int, step: Step) -> None:
    """Let the demand of row i grow no faster than is wise from the rate that is in force.

    That is half of the reachable acceleration, as the braking towards d_s counts on; all of it
    would swing every joint for the last few mm/s. A retreat that is not urgent is eased in.
    """
    rate, most = 0.0, 0.0
    for j in range(len(step.low)):
        rate += rows.jacobian[i, j] * step.previous[j]
        most += BRAKING * abs(rows.jacobian[i, j]) * step.qdd_max[j] * step.dt
    rows.low[i] = min(rows.low[i], rate + most)
    rate = max(rate, 0.0)
    if rows.low[i] > rate and not rows.urgent[i]:
        rows.low[i] = rate + min(step.dt / EASE, 1.0) * (rows.low[i] - rate)


@compiled
def keep_tightest(rows: Rows, first: int, most: int) -> None:
    """Of the rows from `first` on, drop the loosest beyond `most`."""
    while rows.filled[0] - first > most:
        loosest = first
        for i in range(first, rows.filled[0]):
            if rows.low[i] <= rows.low[loosest]:
                loosest = i
        for i in range(loosest, rows.filled[0] - 1):
            _copy(rows, i + 1, i)
        rows.filled[0] -= 1


@compiled
def _copy(rows: Rows, a: int, b: int) -> None:
    """Row a to row b."""
    rows.jacobian[b] = rows.jacobian[a]
    rows.low[b], rows.source[b] = rows.low[a], rows.source[a]
    rows.linear[b], rows.quadratic[b] = rows.linear[a], rows.quadratic[a]
    rows.inside[b], rows.urgent[b] = rows.inside[a], rows.urgent[a]
