"""The compiled following of pairs; what it is for and its formulas are in `steadying`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.measured import (
    AGE,
    APPROACH,
    APPROACH_SIGMA,
    SIGMA,
    SIGMAS,
    Measured,
    approach_now,
    distance_now,
    sigma_now,
)

ROOM = 128  # tracks: four pairs of every link, or one of every sensor, and as many that were lost
SAME_PLACE = 0.08  # [m] on the link: nearer pairs of a link are not told apart by the search either
SAME_WAY = 0.9  # cosine between directions: 26 degrees, likewise
# Before the plates (QP, 0.25 m) half or twice of these two changes the jerk by less than 7 % and
# the distance by 1 mm: what matters is that there are frames to average, not how many.
SURPRISE = 0.02  # [m] two deviations of a zone's range at half a metre
SETTLE = 0.15  # [s] two frames of a sensor
NEARER = 0.01  # [m] a track may lie before a measurement that is nearer: one deviation
FARTHER = 0.04  # [m] and before one that is farther: four
MOVING = 0.12  # [m/s] what approaches faster is believed as measured; the estimate's own limit
CALM = 0.2  # [s] in which an approach is forgotten; it is believed at once
TURN = 0.3  # [s] in which a direction is taken over: with 0.1 the side plate's jerk is 9.4, not 6.0
KEEP = 0.2  # [s] a lost pair stays: three frames; with 0.05 the same jerk is 6.6
RECEDE = 0.3  # [m/s] it then moves away
GONE = 5.0  # [s] after which it is forgotten wherever it is
# [m] a distance is too long by: between two zones' centres a slope comes nearer by half a zone's
# width, 1.2 cm at 0.25 m; without it the QP rests 1.6 cm nearer to the side plate than it should
UNSURE = 0.012


class Followed(NamedTuple):
    """What is followed, a row each.

    link:  (ROOM,) -1 of a free row.   row: (ROOM,) the pair measured now, -1 of a lost one.
    lost:  (ROOM,) [s].   distance, approach: (ROOM,) [m], [m/s].
    sigma: (ROOM,) [m] of the distance.   age: (ROOM,) [s] of its measurement.
    along: (ROOM,) [m] of the place on the robot from that in the world along the normal.
    local: (ROOM, 3) [m] place on the link, its frame.   on_robot, on_world, normal: base frame.
    """

    link: NDArray[np.int64]
    row: NDArray[np.int64]
    lost: Array
    distance: Array
    approach: Array
    sigma: Array
    age: Array
    along: Array
    local: Array
    on_robot: Array
    on_world: Array
    normal: Array


class Told(NamedTuple):
    """The same without gaps, in few arrays, written anew in each tick.

    who:    (2, ROOM) link, row.
    number: (4, ROOM) distance [m], approach [m/s], sigma [m], age [s].
    place: (3, ROOM, 3) on_robot, on_world, normal; base frame.
    """

    who: NDArray[np.int64]
    number: Array
    place: Array


def nothing_told() -> Told:
    """Room for all tracks."""
    return Told(np.empty((2, ROOM), np.int64), np.empty((4, ROOM)), np.empty((3, ROOM, 3)))


def nothing_followed() -> Followed:
    """Room for tracks, all free."""
    none = np.full(ROOM, -1, dtype=np.int64)
    single, triple = np.zeros((6, ROOM)), np.zeros((4, ROOM, 3))
    return Followed(none, none.copy(), *single, *triple)


@compiled
def update(
    known: Followed, T_base_link: Array, pairs: Measured, reach: float, dt: float, out: Told
) -> tuple[int, int]:
    """Follow the pairs and write what is followed, without gaps; how many, and the closest.

    One step after another for all pairs: handing a track to a function for each would cost more
    than what is done there.
    """
    _carry(known, T_base_link)
    track = _match(known, pairs, reach)
    _believe(known, pairs, track, dt)
    _begin(known, pairs, track, reach)
    _place(known, T_base_link, pairs, dt)
    _let_go(known, reach, dt)
    return _write(known, out)


@compiled
def _carry(known: Followed, T_base_link: Array) -> None:
    """What the arm itself has done to each distance."""
    for t in range(len(known.link)):
        known.row[t] = -1
        if known.link[t] < 0:
            continue
        T, along = T_base_link[known.link[t]], 0.0
        for i in range(3):
            known.on_robot[t, i] = T[i, 3]
            for k in range(3):
                known.on_robot[t, i] += T[i, k] * known.local[t, k]
            along += (known.on_robot[t, i] - known.on_world[t, i]) * known.normal[t, i]
        known.distance[t] += along - known.along[t]
        known.along[t] = along


@compiled
def _match(known: Followed, pairs: Measured, reach: float) -> NDArray[np.int64]:
    """The track (B,) of each pair, the nearest that no other has; -1 of none."""
    track = np.full(len(pairs.link), -1)
    for i in range(len(track)):
        if not pairs.distance[i] < reach:
            continue
        best = SAME_PLACE
        for t in range(len(known.link)):
            if known.link[t] != pairs.link[i] or known.row[t] >= 0:
                continue
            square, way = 0.0, 0.0
            for k in range(3):
                square += (known.on_robot[t, k] - pairs.on_robot[i, k]) ** 2
                way += known.normal[t, k] * pairs.normal[i, k]
            if np.sqrt(square) < best and way > SAME_WAY:
                best, track[i] = np.sqrt(square), t
        if track[i] >= 0:
            known.row[track[i]] = i
    return track


@compiled
def _believe(known: Followed, pairs: Measured, track: NDArray[np.int64], dt: float) -> None:
    """Take over distances, their doubt and directions in part."""
    for i in range(len(track)):
        t = track[i]
        if t < 0:
            continue
        w, age = pairs.doubt[APPROACH, i], pairs.doubt[AGE, i]
        measured = distance_now(pairs.distance[i], w, age)
        unsure = sigma_now(pairs.doubt[SIGMA, i], pairs.doubt[APPROACH_SIGMA, i], age)
        known.sigma[t] += min(dt / SETTLE, 1.0) * (unsure - known.sigma[t])
        d = known.distance[t] - w * dt
        error = measured - d
        share = min(1.0, abs(error) / SURPRISE) * dt / SETTLE
        d += min(share, 1.0) * error
        d = min(max(d, measured - FARTHER), measured + NEARER)
        known.distance[t] = min(d, measured) if w > MOVING else d
        square = 0.0
        for k in range(3):
            known.normal[t, k] += min(dt / TURN, 1.0) * (pairs.normal[i, k] - known.normal[t, k])
            square += known.normal[t, k] ** 2
        for k in range(3):
            known.normal[t, k] /= np.sqrt(square)


@compiled
def _begin(known: Followed, pairs: Measured, track: NDArray[np.int64], reach: float) -> None:
    """A track for each pair without one: a free row, or that of the farthest that was lost."""
    for i in range(len(track)):
        if track[i] >= 0 or not pairs.distance[i] < reach:
            continue
        free, far = -1, -1
        for t in range(len(known.link)):
            if known.link[t] < 0:
                free = t
                break
            if known.row[t] < 0 and (far < 0 or known.distance[t] > known.distance[far]):
                far = t
        t = free if free >= 0 else far
        if t < 0:
            continue
        w, w_sigma, age = (
            pairs.doubt[APPROACH, i],
            pairs.doubt[APPROACH_SIGMA, i],
            pairs.doubt[AGE, i],
        )
        known.link[t], known.row[t] = pairs.link[i], i
        known.distance[t] = distance_now(pairs.distance[i], w, age)
        for k in range(3):
            known.normal[t, k] = pairs.normal[i, k]
        known.approach[t] = approach_now(w, w_sigma)
        known.sigma[t] = sigma_now(pairs.doubt[SIGMA, i], w_sigma, age)


@compiled
def _place(known: Followed, T_base_link: Array, pairs: Measured, dt: float) -> None:
    """Where both ends of what is measured are now, and how fast they come."""
    for t in range(len(known.link)):
        i = known.row[t]
        if i < 0:
            continue
        T, along = T_base_link[pairs.link[i]], 0.0
        for k in range(3):
            known.on_robot[t, k], known.on_world[t, k] = pairs.on_robot[i, k], pairs.on_world[i, k]
            along += (pairs.on_robot[i, k] - pairs.on_world[i, k]) * known.normal[t, k]
            known.local[t, k] = 0.0
            for r in range(3):
                known.local[t, k] += T[r, k] * (pairs.on_robot[i, r] - T[r, 3])
        known.along[t], known.lost[t], known.age[t] = along, 0.0, pairs.doubt[AGE, i]
        calmed = known.approach[t] * (1.0 - min(dt / CALM, 1.0))
        w = approach_now(pairs.doubt[APPROACH, i], pairs.doubt[APPROACH_SIGMA, i])
        known.approach[t] = max(w, calmed)


@compiled
def _let_go(known: Followed, reach: float, dt: float) -> None:
    """What is lost calms down, recedes after a moment, and is forgotten beyond `reach`."""
    for t in range(len(known.link)):
        if known.link[t] < 0 or known.row[t] >= 0:
            continue
        known.lost[t] += dt
        known.age[t] += dt
        known.approach[t] *= 1.0 - min(dt / CALM, 1.0)
        if known.lost[t] > KEEP:
            known.distance[t] += RECEDE * dt
        if known.distance[t] >= reach or known.lost[t] > GONE:
            known.link[t] = -1


@compiled
def _write(known: Followed, out: Told) -> tuple[int, int]:
    """Write what is followed; how many, and which of them is the closest, -1 of none."""
    n, closest = 0, -1
    for t in range(len(known.link)):
        if known.link[t] < 0:
            continue
        out.who[0, n], out.who[1, n] = known.link[t], known.row[t]
        out.number[0, n] = known.distance[t] - UNSURE - SIGMAS * known.sigma[t]
        out.number[1, n] = known.approach[t]
        out.number[2, n], out.number[3, n] = known.sigma[t], known.age[t]
        for k in range(3):
            out.place[0, n, k], out.place[1, n, k] = known.on_robot[t, k], known.on_world[t, k]
            out.place[2, n, k] = known.normal[t, k]
        if closest < 0 or out.number[0, n] < out.number[0, closest]:
            closest = n
        n += 1
    return n, closest
