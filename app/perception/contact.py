"""What touches a lens: nearer than its sensor can measure, and the nearest thing there is.

A sensor is touched from the frame on in which `SHARE` of its zones or more see something nearer
than the least distance of its type, and until it sees that leave: as many zones that see something
farther away, and no longer what was near. Bad statuses and nothing at all are no leaving; a
pressed lens gives these, too. While a sensor is touched, each of its zones that sees nothing
farther has its point right before the lens, where the thing was when it was last measured.

A thing that is still at the lens after the arm has carried the lens `RIDES` away is not before the
window but on it, a sticker or dirt: the sensor is covered, and cannot tell. One that has
returned nothing at all for `EMPTY` frames since it was touched cannot tell either.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.placing import Lenses, Reports
from app.perception.unable import Unable
from app.robot.skin import Skin
from app.robot.traits import NOTHING

SHARE = 0.25  # of the zones; a hand at a lens is before all of them, a loose return before few
RIDES = 0.05  # [m] who leans on an arm that gives way does not follow so far at once
EMPTY = 15  # frames: a second
FARTHER = np.zeros(len(Verdict), dtype=bool)  # by verdict: has the zone seen something farther?
FARTHER[[Verdict.KEPT, Verdict.SELF, Verdict.STATIC, Verdict.BEHIND, Verdict.GHOST]] = True
NO_TARGET, CONTACT = int(Verdict.NO_TARGET), int(Verdict.CONTACT)
SEES, COVERED, DARK, TOUCHED = (
    int(u) for u in (Unable.SEES, Unable.COVERED, Unable.DARK, Unable.TOUCHED)
)  # fmt: skip


class Touches(NamedTuple):
    """Of K sensors: touched now; at (K, 3) [m] lens when it began, base frame; empty: frames in a
    row without any return; unable: (K,) of `Unable`."""

    touched: NDArray[np.bool_]
    at: Array
    empty: NDArray[np.int64]
    unable: NDArray[np.uint8]


class Contacts:
    """Which sensors are touched, and which are covered."""

    def __init__(self, skin: Skin) -> None:
        self._count = skin.count
        self.reset()

    def reset(self) -> None:
        """Nothing touches."""
        K = self._count
        self._touches = Touches(
            np.zeros(K, dtype=bool), np.zeros((K, 3)), np.zeros(K, dtype=np.int64),
            np.zeros(K, dtype=np.uint8),
        )  # fmt: skip

    @property
    def unable(self) -> NDArray[np.uint8]:
        """(K,) of `Unable`: touched, covered, dark, or seeing."""
        return self._touches.unable

    def mark(
        self,
        sensors: NDArray[np.intp],
        T_base_link: Array,
        reports: Reports,
        lenses: Lenses,
        verdict: NDArray[np.uint8],
        points: Array,
    ) -> None:
        """Give the zones of those of `sensors` (m,) that are touched the verdict CONTACT and their
        point; verdict (S,) and points (S, 3) are those of their newest frames."""
        _mark(sensors, T_base_link, reports, lenses, self._touches, verdict, points)


@compiled
def _mark(
    sensors: NDArray[np.intp],
    T_base_link: Array,
    reports: Reports,
    lenses: Lenses,
    state: Touches,
    verdict: NDArray[np.uint8],
    points: Array,
) -> None:
    at = np.empty(3)
    for k in sensors:
        first, last, T = lenses.first[k], lenses.first[k + 1], T_base_link[lenses.link[k]]
        near, farther, nothing = _count(k, reports, lenses, verdict)
        share, square = SHARE * (last - first), 0.0
        for a in range(3):
            at[a] = T[a, 3]
            for j in range(3):
                at[a] += T[a, j] * lenses.origin[k, j]
            square += (at[a] - state.at[k, a]) ** 2
        state.empty[k] = state.empty[k] + 1 if nothing == last - first else 0
        if near >= share:
            if not state.touched[k]:
                state.at[k], square, state.unable[k] = at, 0.0, TOUCHED
            state.touched[k] = True
        elif farther >= share:
            state.touched[k], state.unable[k] = False, SEES
        elif state.touched[k] and state.empty[k] >= EMPTY:
            state.touched[k], state.unable[k] = False, DARK
        if not state.touched[k]:
            continue
        if square > RIDES**2:
            state.unable[k] = COVERED
        if state.unable[k] != COVERED:
            _place(k, T, reports, lenses, verdict, points)


@compiled
def _count(
    k: int, reports: Reports, lenses: Lenses, verdict: NDArray[np.uint8]
) -> tuple[int, int, int]:
    """Zones of sensor k that see something too near, something farther, and nothing."""
    near, farther, nothing = 0, 0, 0
    for slot in range(lenses.first[k], lenses.first[k + 1]):
        near += _too_near(k, slot, reports, lenses)
        farther += FARTHER[verdict[slot]]
        nothing += verdict[slot] == NO_TARGET
    return near, farther, nothing


@compiled
def _too_near(k: int, slot: int, reports: Reports, lenses: Lenses) -> bool:
    seen = reports.targets[slot] > 0 and lenses.worth[k, reports.status[slot]] != NOTHING
    return bool(seen and reports.distance[slot] < lenses.limits[k, 0])


@compiled
def _place(
    k: int, T: Array, reports: Reports, lenses: Lenses, verdict: NDArray[np.uint8], points: Array
) -> None:
    """The thing is where it was measured, or half of the least distance before the lens."""
    for slot in range(lenses.first[k], lenses.first[k + 1]):
        if FARTHER[verdict[slot]]:
            continue
        verdict[slot] = CONTACT
        z = 0.5 * lenses.limits[k, 0]
        if _too_near(k, slot, reports, lenses):
            z = max(reports.distance[slot], 0.0)
        for a in range(3):
            points[slot, a] = T[a, 3]
            for j in range(3):
                v = lenses.origin[k, j] + z * lenses.reach[slot, j]
                points[slot, a] += T[a, j] * v
