"""Bounds that neither jump with the sensors' noise nor vanish between two frames.

Each pair is followed from tick to tick: the same link, about the same place on it, about the
same direction. Between frames its distance changes only by what the arm does, which is known
exactly; a new measurement is then taken over in part, the less the smaller the surprise. So
noise is averaged, a lag behind the arm's own motion does not arise, and what is really nearer
is believed at once. A pair that is no longer there is kept for a moment and then moves away at
a walking pace, so that the arm is let go and not thrown off.
"""

from typing import NamedTuple

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
ROOM = 128  # pairs that are followed
NO_SLOT = freeze(np.full(ROOM, -1, dtype=np.intp))


class SteadyRows:
    """Follows the pairs; `update` gives those to keep clear of and where each came from."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Follow nothing."""
        none = np.full(ROOM, -1, dtype=np.int64)
        single, triple = np.zeros((4, ROOM)), np.zeros((4, ROOM, 3))
        self._tracks = _Tracks(none, none.copy(), *single, *triple)

    def update(
        self, posture: Posture, pairs: Pairs, approach: Array | None, reach: float, dt: float
    ) -> tuple[Pairs, NDArray[np.intp]]:
        """The pairs nearer than `reach` [m], steadied, and the row of `pairs` of each, -1 lost.

        approach: (B,) [m/s] speed of each pair's world point towards the robot.
        """
        w = np.zeros(len(pairs.distance)) if approach is None else approach
        link, row = np.empty((2, ROOM), np.int64)
        distance, coming = np.empty((2, ROOM))
        on_robot, on_world, normal = np.empty((3, ROOM, 3))
        n, closest = _update(
            posture.T_base_link, pairs.link, pairs.distance, pairs.on_robot, pairs.on_world,
            pairs.normal, w, reach, dt, self._tracks,
            link, row, distance, coming, on_robot, on_world, normal,
        )  # fmt: skip
        steady = Pairs(
            link[:n], distance[:n], on_robot[:n], on_world[:n], normal[:n], NO_SLOT[:n], closest,
            coming[:n],
        )  # fmt: skip
        return steady, row[:n]


class _Tracks(NamedTuple):
    """What is followed, a row each: its link, -1 for a free row, and the pair seen now, -1 lost.

    lost: (ROOM,) [s].   distance, approach, apart: (ROOM,) [m], [m/s], [m] as last computed.
    local: (ROOM, 3) [m] place on the link.   world, normal, on: (ROOM, 3) base frame.
    """

    link: NDArray[np.int64]
    row: NDArray[np.int64]
    lost: Array
    distance: Array
    approach: Array
    apart: Array
    local: Array
    world: Array
    normal: Array
    on: Array


@compiled
def _update(
    T_base_link: Array,
    link: NDArray[np.int64],
    distance: Array,
    on_robot: Array,
    on_world: Array,
    normal: Array,
    approach: Array,
    reach: float,
    dt: float,
    tracks: _Tracks,
    out_link: NDArray[np.int64],
    out_row: NDArray[np.int64],
    out_distance: Array,
    out_coming: Array,
    out_robot: Array,
    out_world: Array,
    out_normal: Array,
) -> tuple[int, int]:
    """Follow, then tell."""
    _follow(
        T_base_link, link, distance, on_robot, on_world, normal, approach, reach, dt, tracks
    )  # fmt: skip
    return _tell(
        tracks, out_link, out_row, out_distance, out_coming, out_robot, out_world, out_normal
    )


@compiled
def _tell(
    tracks: _Tracks,
    link: NDArray[np.int64],
    row: NDArray[np.int64],
    distance: Array,
    coming: Array,
    on_robot: Array,
    on_world: Array,
    normal: Array,
) -> tuple[int, int]:
    """Write down what is followed; how many, and which of them is the closest, -1 of none."""
    n, closest = 0, -1
    for t in range(len(tracks.link)):
        if tracks.link[t] < 0:
            continue
        link[n], row[n] = tracks.link[t], tracks.row[t]
        distance[n], coming[n] = tracks.distance[t] - UNSURE, tracks.approach[t]
        for k in range(3):
            on_robot[n, k], on_world[n, k] = tracks.on[t, k], tracks.world[t, k]
            normal[n, k] = tracks.normal[t, k]
        if closest < 0 or distance[n] < distance[closest]:
            closest = n
        n += 1
    return n, closest


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
    tracks: _Tracks,
) -> None:
    """Carry what is followed on to this posture, match it with the pairs, take them over."""
    t_link, t_row, t_lost, t_distance, t_approach, t_apart = tracks[:6]
    t_local, t_world, t_normal, t_on = tracks[6:]
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
        best, which, free, far = SAME_PLACE, -1, -1, -1
        for t in range(len(t_link)):
            if t_link[t] < 0:
                free = t if free < 0 else free
            elif t_row[t] < 0 and (far < 0 or t_distance[t] > t_distance[far]):
                far = t
            if t_link[t] == link[i] and t_row[t] < 0:
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
        elif free >= 0 or far >= 0:
            t = free if free >= 0 else far  # what is seen takes the place of what was lost
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
