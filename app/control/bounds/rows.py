"""The rows of a quadratic programme's bounds, and what is common to all kinds of them.

A row says  J qd + s >= low , where J qd is the rate of a distance and s >= 0 the slack that it
costs `linear` s + `quadratic` s^2 / 2 to take. A kind of bound appends its rows to a sheet; it
leaves out those that no velocity of the step ahead breaks, since they change nothing.
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
LOW, LINEAR, QUADRATIC = 0, 1, 2  # rows of `Sheet.number`
SOURCE, INSIDE, URGENT = 0, 1, 2  # rows of `Sheet.mark`


class Rows(NamedTuple):
    """m bounds: jacobian (m, n), low (m,) [m/s], linear and quadratic cost of slack (m,).

    source: (m,) row of the pairs that a bound came from, -1 for the robot itself and the cell.
    inside: (m,) not 0 where what is bound is nearer than it should be.
    """

    jacobian: Array
    low: Array
    linear: Array
    quadratic: Array
    source: NDArray[np.int64]
    inside: NDArray[np.int64]


class Sheet(NamedTuple):
    """Rows while they are written, in few arrays: each costs a call of a kernel 0.15 us.

    jacobian: (room, n).   filled: (1,) rows that are in use.
    number:   (3, room) low, linear, quadratic.
    mark:     (3, room) source, inside, and urgent: is a retreat demanded at once?
    """

    jacobian: Array
    number: Array
    mark: NDArray[np.int64]
    filled: NDArray[np.int64]


class Bound(Protocol):
    """One kind of bounds."""

    def append(self, now: Situation, step: Step, sheet: Sheet) -> None:
        """Append the bounds that some velocity of the step ahead breaks."""
        ...


class Motion(NamedTuple):
    """A posture for kernels: T_base_link (L, 4, 4), J_base (6, n), supports (L, n), and of each
    joint into (n,) whose column its rate goes, and how many times (n,)."""

    T_base_link: Array
    J_base: Array
    supports: Array
    into: NDArray[np.int64]
    times: Array


def empty_sheet(room: int, joints: int) -> Sheet:
    """No rows yet, and room for some."""
    return Sheet(
        np.empty((room, joints)), np.empty((3, room)), np.empty((3, room), np.int64),
        np.zeros(1, np.int64),
    )  # fmt: skip


def rows_of(sheet: Sheet) -> Rows:
    """The rows that are in use."""
    m, number, mark = sheet.filled[0], sheet.number, sheet.mark
    return Rows(
        sheet.jacobian[:m], number[LOW, :m], number[LINEAR, :m], number[QUADRATIC, :m],
        mark[SOURCE, :m], mark[INSIDE, :m],
    )  # fmt: skip


def motion(posture: Posture) -> Motion:
    """The posture's arrays."""
    gears = posture.gears
    return Motion(
        posture.T_base_link, posture.J_base, posture.supports, gears.into, gears.times
    )  # fmt: skip


@compiled
def put(
    sheet: Sheet, low: float, cost: tuple[float, float], source: int, inside: bool, urgent: bool
) -> int:
    """Take the next row into use, whose jacobian is written already; its number."""
    m = sheet.filled[0]
    sheet.number[LOW, m] = low
    sheet.number[LINEAR, m], sheet.number[QUADRATIC, m] = cost
    sheet.mark[SOURCE, m], sheet.mark[INSIDE, m], sheet.mark[URGENT, m] = source, inside, urgent
    sheet.filled[0] += 1
    return int(m)


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
            J[moves.into[j]] += moves.times[j] * (sign * support[j] * (along + turn))


@compiled
def authority(J: Array, qd_max: Array, qdd_max: Array) -> tuple[float, float]:
    """Largest speed [m/s] and wise acceleration [m/s^2] along a row, all joints together."""
    speed, acceleration = 0.0, 0.0
    for j in range(len(J)):
        speed += abs(J[j]) * qd_max[j]
        acceleration += BRAKING * abs(J[j]) * qdd_max[j]
    return speed, acceleration


@compiled
def bites(J: Array, bound: float, low: Array, high: Array) -> bool:
    """Does some velocity low (n,) <= qd <= high (n,) break the bound?"""
    least = 0.0
    for j in range(len(J)):
        if J[j] != 0.0:
            least += J[j] * (low[j] if J[j] > 0.0 else high[j])
    return least < bound


@compiled
def ease(sheet: Sheet, i: int, step: Step) -> None:
    """Let the demand of row i grow no faster than is wise from the rate that is in force.

    That is half of the reachable acceleration, as the braking towards d_s counts on; all of it
    would swing every joint for the last few mm/s. A retreat that is not urgent is eased in.
    """
    rate, most, low = 0.0, 0.0, sheet.number[LOW]
    for j in range(len(step.low)):
        rate += sheet.jacobian[i, j] * step.previous[j]
        most += BRAKING * abs(sheet.jacobian[i, j]) * step.qdd_max[j] * step.dt
    low[i] = min(low[i], rate + most)
    rate = max(rate, 0.0)
    if low[i] > rate and sheet.mark[URGENT, i] == 0:
        low[i] = rate + min(step.dt / EASE, 1.0) * (low[i] - rate)


@compiled
def keep_tightest(sheet: Sheet, first: int, most: int) -> None:
    """Of the rows from `first` on, drop the loosest beyond `most`; the others keep their order."""
    low = sheet.number[LOW]
    while sheet.filled[0] - first > most:
        loosest = first
        for i in range(first, sheet.filled[0]):
            if low[i] <= low[loosest]:
                loosest = i
        for i in range(loosest, sheet.filled[0] - 1):
            sheet.jacobian[i] = sheet.jacobian[i + 1]
            for k in range(3):
                sheet.number[k, i], sheet.mark[k, i] = sheet.number[k, i + 1], sheet.mark[k, i + 1]
        sheet.filled[0] -= 1
