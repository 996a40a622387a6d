"""Bounds that neither jump with the sensors' noise nor vanish between two frames.

Each pair is followed from tick to tick: the same link, about the same place on it, about the
same direction. Between frames its distance changes only by what the arm does, which is known
exactly; a new measurement is then taken over in part, the less the smaller the surprise. So
noise is averaged, a lag behind the arm's own motion does not arise, and what is really nearer
is believed at once. A pair that is no longer there is kept for a moment and then moves away at
a walking pace, so that the arm is let go and not thrown off.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Pairs, freeze
from app.robot.posture import Posture

SAME_PLACE, SAME_WAY = 0.08, 0.9  # [m] on the link, cosine between directions
SETTLE = 0.15  # [s] in which a surprise of `SURPRISE` is taken over
SURPRISE = 0.02  # [m] smaller ones are taken over more slowly in proportion, as noise is
NEARER, FARTHER = 0.01, 0.04  # [m] a measurement may be before, beyond what is believed
MOVING = 0.12  # [m/s] what approaches faster is believed as measured
CALM = 0.2  # [s] in which an approach is forgotten; it is believed at once
TURN = 0.3  # [s] in which a direction is taken over
KEEP, RECEDE = 0.2, 0.3  # [s] a lost pair stays, [m/s] it then moves away
UNSURE = 0.012  # [m] a measured distance is too long by: between zones lies something nearer
ROOM = 64  # pairs that are followed


class SteadyRows:
    """Follows the pairs; `update` gives those to keep clear of and where each came from."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Follow nothing."""
        self._link = np.full(ROOM, -1, dtype=np.int64)
        self._row = np.full(ROOM, -1, dtype=np.int64)
        self._lost = np.zeros(ROOM)
        self._distance, self._approach = np.zeros(ROOM), np.zeros(ROOM)
        self._local, self._world, self._normal = (np.zeros((ROOM, 3)) for _ in range(3))
        self._apart = np.zeros(ROOM)

    def update(
        self, posture: Posture, pairs: Pairs, approach: Array | None, reach: float, dt: float
    ) -> tuple[Pairs, NDArray[np.intp]]:
        """The pairs nearer than `reach` [m], steadied, and the row of `pairs` of each, -1 lost.

        approach: (B,) [m/s] speed of each pair's world point towards the robot.
        """
        w = np.zeros(len(pairs.distance)) if approach is None else approach
        on_robot = np.empty((ROOM, 3))
        _follow(
            posture.T_base_link, pairs.link, pairs.distance, pairs.on_robot, pairs.on_world,
            pairs.normal, w, reach, dt, self._link, self._row, self._lost, self._distance,
            self._approach, self._local, self._world, self._normal, self._apart, on_robot,
        )  # fmt: skip
        used = np.flatnonzero(self._link >= 0)
        distance = self._distance[used] - UNSURE
        steady = Pairs(
            link=self._link[used],
            distance=freeze(distance),
            on_robot=freeze(on_robot[used]),
            on_world=freeze(self._world[used]),
            normal=freeze(self._normal[used]),
            slot=np.full(len(used), -1, dtype=np.intp),
            closest=int(np.argmin(distance)) if len(used) else -1,
            approach=freeze(self._approach[used]),
        )
        return steady, self._row[used]


@compiled
def _follow(
    T_base_link: Array,
    link: NDArray[np.int64],
    distance: Array,
    on_robot: Array,
    on_world: Array,
    normal: Array,
    approach: Array,
    reach: float,
    dt: float,
    t_link: NDArray[np.int64],
    t_row: NDArray[np.int64],
    t_lost: Array,
    t_distance: Array,
    t_approach: Array,
    t_local: Array,
    t_world: Array,
    t_normal: Array,
    t_apart: Array,
    t_on: Array,
) -> None:
    """Carry what is followed on to this posture, match it with the pairs, take them over."""
    for t in range(len(t_link)):
        t_row[t] = -1
        if t_link[t] < 0:
            continue
        T = T_base_link[t_link[t]]
        apart = 0.0
        for i in range(3):
            t_on[t, i] = T[i, 3]
            for k in range(3):
                t_on[t, i] += T[i, k] * t_local[t, k]
            apart += (t_on[t, i] - t_world[t, i]) * t_normal[t, i]
        t_distance[t] += apart - t_apart[t]  # what the arm itself has done
        t_apart[t] = apart
    for i in range(len(link)):
        if not distance[i] < reach:
            continue
        best, which, free = SAME_PLACE, -1, -1
        for t in range(len(t_link)):
            if t_link[t] < 0:
                free = t if free < 0 else free
            elif t_link[t] == link[i] and t_row[t] < 0:
                place, way = 0.0, 0.0
                for k in range(3):
                    place += (t_on[t, k] - on_robot[i, k]) ** 2
                    way += t_normal[t, k] * normal[i, k]
                if np.sqrt(place) < best and way > SAME_WAY:
                    best, which = np.sqrt(place), t
        if which >= 0:
            t = which
            error = distance[i] - (t_distance[t] - approach[i] * dt)
            share = min(1.0, abs(error) / SURPRISE) * dt / SETTLE
            d = t_distance[t] - approach[i] * dt + min(share, 1.0) * error
            d = min(max(d, distance[i] - FARTHER), distance[i] + NEARER)
            if approach[i] > MOVING:
                d = min(d, distance[i])
            t_distance[t] = d
            length = 0.0
            for k in range(3):
                t_normal[t, k] += min(dt / TURN, 1.0) * (normal[i, k] - t_normal[t, k])
                length += t_normal[t, k] ** 2
            for k in range(3):
                t_normal[t, k] /= np.sqrt(length)
        elif free >= 0:
            t = free
            t_link[t], t_distance[t] = link[i], distance[i]
            t_normal[t], t_approach[t] = normal[i], approach[i]
        else:
            continue
        t_row[t], t_lost[t] = i, 0.0
        t_approach[t] = max(approach[i], t_approach[t] * (1.0 - min(dt / CALM, 1.0)))
        T = T_base_link[link[i]]
        apart = 0.0
        for k in range(3):
            t_on[t, k], t_world[t, k] = on_robot[i, k], on_world[i, k]
            apart += (on_robot[i, k] - on_world[i, k]) * t_normal[t, k]
            t_local[t, k] = 0.0
            for r in range(3):
                t_local[t, k] += T[r, k] * (on_robot[i, r] - T[r, 3])
        t_apart[t] = apart
    for t in range(len(t_link)):
        if t_link[t] >= 0 and t_row[t] < 0:
            t_lost[t] += dt
            t_approach[t] *= 1.0 - min(dt / CALM, 1.0)
            if t_lost[t] > KEEP:
                t_distance[t] += RECEDE * dt
            if t_distance[t] >= reach:
                t_link[t] = -1
