"""Pairs that neither jump with the sensors' noise nor vanish between two frames.

Each measured pair is followed from tick to tick by a track: the same link, about the same place
on it, about the same direction. Between frames its distance changes only by what the arm does,
which is known exactly, and by what the world does:

    d <- d + n . (on(q) - on(q before)) - w dt

A measurement m is then taken over in part, the less the smaller the surprise e = m - d:

    d <- d + min(1, |e| / SURPRISE) (dt / SETTLE) e ,   m - FARTHER <= d <= m + NEARER

So noise is averaged, a lag behind the arm's own motion does not arise, and what is really nearer
is believed at once. A pair that is no longer measured stays for a moment and then moves away at
a walking pace, so that the arm is let go and not thrown off.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Pairs, freeze
from app.robot.posture import Posture

ROOM = 128  # tracks: four pairs of every link, or one of every sensor, and as many that were lost
SAME_PLACE = 0.08  # [m] on the link: nearer pairs of a link are not told apart by the search either
SAME_WAY = 0.9  # cosine between directions: 26 degrees, likewise
SURPRISE = 0.02  # [m] two deviations of a zone's range at half a metre
SETTLE = 0.15  # [s] two frames of a sensor
NEARER = 0.01  # [m] a track may lie before a measurement that is nearer: one deviation
FARTHER = 0.04  # [m] and before one that is farther: four
MOVING = 0.12  # [m/s] what approaches faster is believed as measured; the estimate's own limit
CALM = 0.2  # [s] in which an approach is forgotten; it is believed at once
TURN = 0.3  # [s] in which a direction is taken over: four frames
KEEP = 0.2  # [s] a lost pair stays: three frames
RECEDE = 0.3  # [m/s] it then moves away
GONE = 5.0  # [s] after which it is forgotten wherever it is
UNSURE = 0.012  # [m] a distance is too long by: half a zone's width at 0.25 m, sloping, is nearer


class Measured(NamedTuple):
    """The pairs (B,) of this tick, as in `Pairs`; approach: (B,) [m/s]."""

    link: NDArray[np.int64]
    distance: Array
    approach: Array
    on_robot: Array
    on_world: Array
    normal: Array


class Tracks(NamedTuple):
    """What is followed, a row each.

    link:  (ROOM,) -1 of a free row.   row: (ROOM,) the pair measured now, -1 of a lost one.
    lost:  (ROOM,) [s].   distance, approach: (ROOM,) [m], [m/s].
    along: (ROOM,) [m] of the place on the robot from that in the world along the normal.
    local: (ROOM, 3) [m] place on the link, its frame.   on_robot, on_world, normal: base frame.
    """

    link: NDArray[np.int64]
    row: NDArray[np.int64]
    lost: Array
    distance: Array
    approach: Array
    along: Array
    local: Array
    on_robot: Array
    on_world: Array
    normal: Array


class Steadying:
    """Measured pairs in, steady ones out."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Follow nothing."""
        self._tracks = _no_tracks()

    def update(self, posture: Posture, pairs: Pairs, reach: float, dt: float) -> Pairs:
        """The pairs nearer than `reach` [m], steadied; `source` is the row of `pairs` of each.

        dt: [s] since the last call. Ages are not followed.
        """
        w = np.zeros(len(pairs.distance)) if pairs.approach is None else pairs.approach
        measured = Measured(
            pairs.link, pairs.distance, w, pairs.on_robot, pairs.on_world, pairs.normal
        )  # fmt: skip
        out = _no_tracks()
        n, closest = _update(self._tracks, posture.T_base_link, measured, reach, dt, out)
        source = freeze(out.row[:n])
        return Pairs(
            link=freeze(out.link[:n]),
            distance=freeze(out.distance[:n]),
            on_robot=freeze(out.on_robot[:n]),
            on_world=freeze(out.on_world[:n]),
            normal=freeze(out.normal[:n]),
            slot=_slots(pairs, source),
            closest=closest,
            approach=freeze(out.approach[:n]),
            source=source,
        )


def aged(steady: Pairs, pairs: Pairs, lost: float) -> Pairs:
    """`steady` with the ages [s] of the `pairs` that each came from, `lost` of one out of sight."""
    assert pairs.age is not None and steady.source is not None
    age = np.full(len(steady.source), lost)
    seen = steady.source >= 0
    age[seen] = pairs.age[steady.source[seen]]
    return replace(steady, age=freeze(age))


def _slots(pairs: Pairs, source: NDArray[np.intp]) -> NDArray[np.intp]:
    """Where each world point came from, -1 of a lost one."""
    slot = np.full(len(source), -1, dtype=np.intp)
    seen = source >= 0
    slot[seen] = pairs.slot[source[seen]]
    return freeze(slot)


def _no_tracks() -> Tracks:
    none = np.full(ROOM, -1, dtype=np.int64)
    single, triple = np.zeros((4, ROOM)), np.zeros((4, ROOM, 3))
    return Tracks(none, none.copy(), *single, *triple)


@compiled
def _update(
    tracks: Tracks, T_base_link: Array, pairs: Measured, reach: float, dt: float, out: Tracks
) -> tuple[int, int]:
    """Follow the pairs and write what is followed, without gaps; how many, and the closest."""
    _carry(tracks, T_base_link)
    for i in range(len(pairs.link)):
        if pairs.distance[i] < reach:
            _follow(tracks, T_base_link, pairs, i, dt)
    _let_go(tracks, reach, dt)
    return _write(tracks, out)


@compiled
def _carry(tracks: Tracks, T_base_link: Array) -> None:
    """What the arm itself has done to each distance."""
    for t in range(len(tracks.link)):
        tracks.row[t] = -1
        if tracks.link[t] < 0:
            continue
        T, along = T_base_link[tracks.link[t]], 0.0
        for i in range(3):
            tracks.on_robot[t, i] = T[i, 3]
            for k in range(3):
                tracks.on_robot[t, i] += T[i, k] * tracks.local[t, k]
            along += (tracks.on_robot[t, i] - tracks.on_world[t, i]) * tracks.normal[t, i]
        tracks.distance[t] += along - tracks.along[t]
        tracks.along[t] = along


@compiled
def _follow(tracks: Tracks, T_base_link: Array, pairs: Measured, i: int, dt: float) -> None:
    """Find the track of pair i, or begin one, and take the measurement over."""
    t = _same(tracks, pairs, i)
    if t >= 0:
        _believe(tracks, t, pairs, i, dt)
    else:
        t = _room_for_one(tracks)
        if t < 0:
            return
        tracks.link[t], tracks.distance[t] = pairs.link[i], pairs.distance[i]
        tracks.normal[t], tracks.approach[t] = pairs.normal[i], pairs.approach[i]
    tracks.row[t], tracks.lost[t] = i, 0.0
    calmed = tracks.approach[t] * (1.0 - min(dt / CALM, 1.0))
    tracks.approach[t] = max(pairs.approach[i], calmed)
    _place(tracks, t, T_base_link[pairs.link[i]], pairs, i)


@compiled
def _same(tracks: Tracks, pairs: Measured, i: int) -> int:
    """The track, not yet taken, that is nearest to the place of pair i; -1 of none."""
    best, which = SAME_PLACE, -1
    for t in range(len(tracks.link)):
        if tracks.link[t] != pairs.link[i] or tracks.row[t] >= 0:
            continue
        square, way = 0.0, 0.0
        for k in range(3):
            square += (tracks.on_robot[t, k] - pairs.on_robot[i, k]) ** 2
            way += tracks.normal[t, k] * pairs.normal[i, k]
        if np.sqrt(square) < best and way > SAME_WAY:
            best, which = np.sqrt(square), t
    return which


@compiled
def _room_for_one(tracks: Tracks) -> int:
    """A free row; or what is seen takes the place of the farthest that was lost; or -1."""
    far = -1
    for t in range(len(tracks.link)):
        if tracks.link[t] < 0:
            return t
        if tracks.row[t] < 0 and (far < 0 or tracks.distance[t] > tracks.distance[far]):
            far = t
    return far


@compiled
def _believe(tracks: Tracks, t: int, pairs: Measured, i: int, dt: float) -> None:
    """Take over distance and direction in part."""
    measured, w = pairs.distance[i], pairs.approach[i]
    d = tracks.distance[t] - w * dt
    error = measured - d
    share = min(1.0, abs(error) / SURPRISE) * dt / SETTLE
    d += min(share, 1.0) * error
    d = min(max(d, measured - FARTHER), measured + NEARER)
    tracks.distance[t] = min(d, measured) if w > MOVING else d
    normal, square = tracks.normal[t], 0.0
    for k in range(3):
        normal[k] += min(dt / TURN, 1.0) * (pairs.normal[i, k] - normal[k])
        square += normal[k] ** 2
    for k in range(3):
        normal[k] /= np.sqrt(square)


@compiled
def _place(tracks: Tracks, t: int, T: Array, pairs: Measured, i: int) -> None:
    """Where both ends are now; T (4, 4) of the link."""
    along = 0.0
    for k in range(3):
        tracks.on_robot[t, k], tracks.on_world[t, k] = pairs.on_robot[i, k], pairs.on_world[i, k]
        along += (pairs.on_robot[i, k] - pairs.on_world[i, k]) * tracks.normal[t, k]
        tracks.local[t, k] = 0.0
        for r in range(3):
            tracks.local[t, k] += T[r, k] * (pairs.on_robot[i, r] - T[r, 3])
    tracks.along[t] = along


@compiled
def _let_go(tracks: Tracks, reach: float, dt: float) -> None:
    """What is lost calms down, recedes after a moment, and is forgotten beyond `reach`."""
    for t in range(len(tracks.link)):
        if tracks.link[t] < 0 or tracks.row[t] >= 0:
            continue
        tracks.lost[t] += dt
        tracks.approach[t] *= 1.0 - min(dt / CALM, 1.0)
        if tracks.lost[t] > KEEP:
            tracks.distance[t] += RECEDE * dt
        if tracks.distance[t] >= reach or tracks.lost[t] > GONE:
            tracks.link[t] = -1


@compiled
def _write(tracks: Tracks, out: Tracks) -> tuple[int, int]:
    """Write what is followed; how many, and which of them is the closest, -1 of none."""
    n, closest = 0, -1
    for t in range(len(tracks.link)):
        if tracks.link[t] < 0:
            continue
        out.link[n], out.row[n] = tracks.link[t], tracks.row[t]
        out.distance[n], out.approach[n] = tracks.distance[t] - UNSURE, tracks.approach[t]
        for k in range(3):
            out.on_robot[n, k], out.on_world[n, k] = tracks.on_robot[t, k], tracks.on_world[t, k]
            out.normal[n, k] = tracks.normal[t, k]
        if closest < 0 or out.distance[n] < out.distance[closest]:
            closest = n
        n += 1
    return n, closest
