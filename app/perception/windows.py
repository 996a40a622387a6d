"""Dirty windows: what they make of the arm's own body, and which sensors have one.

A dirty window sends light back as well, and near returns are drawn towards it, the more the weaker
they are (`app.perception.behind` tells which may be). So a thing is doubted that

- lies before the body in all of its zones, where that is seen at its outline or hardly behind,
- and is nowhere two zones wide both ways, but for the zones that are hardly before the body.

What the window makes of the body rides with the arm, or jumps from frame to frame. A thing of the
world stays where it is, or moves on. So what is doubted is believed when it was followed through
`SURE` frames and has moved for the sensor, and for the link behind it, by a `WAY` and more, but
hardly in the world; or when it was not doubted and has gone there. Where that link itself stands,
its outline does as well. A thing of the world that is so thin and stays before an outline costs two
frames, and the way.

What was doubted and is gone in the next frame, or elsewhere in its own zone, with nothing else
before the sensor, tells of the window. So does a lone zone that sees something nearer than the
sensor can measure: the window itself. `MANY` of these within half a minute and the window is called
dirty. What is doubted is the arm's own from then on, unless it shows itself to be of the world on a
longer way.

Zones of coarse sensors are wide, and what is thin in their image is not: they are left out.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.behind import hardly
from app.perception.placing import Lenses, Reports
from app.perception.returns import Judgement
from app.perception.things import find_thin, grow
from app.robot.skin import Skin
from app.robot.traits import NOTHING

KEPT, GHOST, SELF = int(Verdict.KEPT), int(Verdict.GHOST), int(Verdict.SELF)
FINE = np.radians(8.0)  # widest zone of a sensor in whose image a thing can be thin
SURE = 3  # frames in a row
NEARER = 0.03  # [m] along the ray between two frames: half a metre a second at 15 Hz
ASIDE = 1.5  # zones across it: a point is told in the middle of its zone
WAY = 0.02  # [m] and a zone's width, for the sensor
LESS = 0.5  # of what it has moved for the sensor, a thing that stands may seem to move in the world
LONGER = 2.0  # times that way, behind a dirty window
MANY, FEW, LASTS = 3.0, 1.0, 30.0  # signs that make a window dirty and clean again; they fade [s]


class Windows(NamedTuple):
    """What is known of S zones and K sensors.

    times: (S,) frames in a row for which a kept zone's thing was followed, 0 of other zones;
           `SURE` and more: it is believed.
    place: (S, 3) [m] where it is, base frame.   begin, rode, lay: (S, 3) [m] where it was first,
           base frame, and in the frames of the sensor's link and of the one behind.
    behind: (S,) which link that was.
    doubted: (S,) is it?
    signs: (K,) of dirt.   stamp: (K,) [s] of the last frame.   dirty: (K,).
    """

    times: NDArray[np.int64]
    place: Array
    begin: Array
    rode: Array
    lay: Array
    behind: NDArray[np.int16]
    doubted: NDArray[np.bool_]
    signs: Array
    stamp: Array
    dirty: NDArray[np.bool_]


class Images(NamedTuple):
    """Of K sensors: first (K + 1,) zones, grid (K, 2), width (K,) [rad] of a zone, fine (K,)."""

    first: NDArray[np.int64]
    grid: NDArray[np.int64]
    width: Array
    fine: NDArray[np.bool_]


class Sight(NamedTuple):
    """Of the newest frames: points (S, 3) [m] base frame, stamp (K,) [s]; T_base_link (L, 4, 4) of
    those that have just come."""

    points: Array
    stamp: Array
    T_base_link: Array


class DirtyWindows:
    """Watches the windows of a skin."""

    def __init__(self, skin: Skin) -> None:
        width = np.array([max(s.type.pitch) for s in skin.sensors])
        self._images = Images(skin.first, skin.grid, width, width <= FINE)
        self._none = np.full(skin.slots, -1, dtype=np.int16)
        self.reset()

    def reset(self) -> None:
        """All windows are clean, and nothing has been seen."""
        S, K = len(self._none), len(self._images.grid)
        self._asked = np.zeros(S, dtype=bool)
        self._windows = Windows(
            times=np.zeros(S, dtype=np.int64), place=np.zeros((S, 3)), begin=np.zeros((S, 3)),
            rode=np.zeros((S, 3)), lay=np.zeros((S, 3)), behind=self._none.copy(),
            doubted=np.zeros(S, dtype=bool), signs=np.zeros(K), stamp=np.full(K, -np.inf),
            dirty=np.zeros(K, dtype=bool),
        )  # fmt: skip

    @property
    def dirty(self) -> NDArray[np.bool_]:
        """(K,) which sensors have a dirty window; written at the next frame."""
        return self._windows.dirty

    @property
    def doubted(self) -> NDArray[np.bool_]:
        """(S,) which zones see what is doubted, believed or not; written at the next frame."""
        return self._windows.doubted

    def doubtful(
        self, sensors: NDArray[np.intp], distance: Array, judged: Judgement
    ) -> NDArray[np.bool_] | None:
        """(S,) which zones of `sensors` (m,) see something thin, or hardly before the body, and
        are to be asked what is behind; None if none does."""
        seen = distance, judged.gap, judged.verdict
        count = _find_thin(sensors, *seen, self._images, self._asked)
        return self._asked if count else None

    def mark(
        self,
        sensors: NDArray[np.intp],
        drawn: NDArray[np.int16] | None,
        sight: Sight,
        reports: Reports,
        lenses: Lenses,
        verdict: NDArray[np.uint8],
    ) -> None:
        """Turn KEPT into GHOST, or SELF behind a dirty window, where a thing is doubted.

        drawn: (S,) link behind the doubtful zones whose report may be of that, -1 of the others.
        """
        behind = self._none if drawn is None else drawn
        _mark(sensors, behind, sight, reports, lenses, self._images, self._windows, verdict)


@compiled
def _find_thin(
    sensors: NDArray[np.intp],
    distance: Array,
    gap: Array,
    verdict: NDArray[np.uint8],
    images: Images,
    thin: NDArray[np.bool_],
) -> int:
    """Write which zones of `sensors` (m,) see a thing that is thin but for what is hardly before
    the body, (S,); how many."""
    count = 0
    for k in sensors:
        begin, end = images.first[k], images.first[k + 1]
        thin[begin:end] = False
        if images.fine[k]:
            kept, z, g = verdict[begin:end] == KEPT, distance[begin:end], gap[begin:end]
            if kept.any():
                sure = np.empty(end - begin, dtype=np.bool_)
                for i in range(end - begin):
                    sure[i] = kept[i] and not hardly(g[i], z[i] + g[i])
                count += find_thin(z, kept, sure, images.grid[k], thin[begin:end])
    return count


@compiled
def _mark(
    sensors: NDArray[np.intp],
    drawn: NDArray[np.int16],
    sight: Sight,
    reports: Reports,
    lenses: Lenses,
    images: Images,
    windows: Windows,
    verdict: NDArray[np.uint8],
) -> None:
    """See `DirtyWindows.mark`; renews `windows`."""
    for k in sensors:
        if not images.fine[k]:
            continue
        begin, end = images.first[k], images.first[k + 1]
        kept, times = verdict[begin:end] == KEPT, windows.times[begin:end]
        signs = _shows_itself(k, reports, lenses)
        if kept.any() or times.any():
            clear = kept & (drawn[begin:end] < 0)
            grow(clear, reports.distance[begin:end], kept, images.grid[k])
            windows.doubted[begin:end] = kept & ~clear
            known, waited = clear.any() or (times >= SURE).any(), times > 0
            before = np.full(end - begin, -1, dtype=np.int64)
            if waited.any():
                _follow(k, kept, sight, lenses, images, windows, before)
            jumps = (kept & waited & (before < 0)).any() or before.max() < 0
            signs += int(waited.any() and not known and jumps)
            _believe(k, kept, drawn[begin:end], before, sight, lenses, images, windows)
        _weigh(k, signs, begin, end, sight.stamp[k], windows)
        for i in range(end - begin):
            if kept[i] and times[i] < SURE:
                verdict[begin + i] = SELF if windows.dirty[k] else GHOST


@compiled
def _follow(
    k: int,
    kept: NDArray[np.bool_],
    sight: Sight,
    lenses: Lenses,
    images: Images,
    windows: Windows,
    before: NDArray[np.int64],
) -> None:
    """Write the zone of the last frame of sensor k, this one or one beside it, in which the thing
    of each kept zone (n,) was at its place and had been followed for longest."""
    rows, columns, first = images.grid[k, 0], images.grid[k, 1], images.first[k]
    T, lens = sight.T_base_link[lenses.link[k]], np.empty(3)
    for a in range(3):
        lens[a] = T[a, 3]
        for j in range(3):
            lens[a] += T[a, j] * lenses.origin[k, j]
    for i in range(len(kept)):
        if not kept[i]:
            continue
        row, column, most = i // columns, i % columns, 0
        for r in range(max(0, row - 1), min(rows, row + 2)):
            for c in range(max(0, column - 1), min(columns, column + 2)):
                j = r * columns + c
                longer = windows.times[first + j] > most
                if longer and _is_there(
                    sight.points[first + i], windows.place[first + j], lens, images.width[k]
                ):
                    before[i], most = j, windows.times[first + j]


@compiled
def _is_there(point: Array, place: Array, lens: Array, width: float) -> bool:
    """Is a point (3,) at a place (3,), as a zone of this width [rad] sees it from its lens (3,)?"""
    away, along, square = 0.0, 0.0, 0.0
    for a in range(3):
        u, v = point[a] - lens[a], point[a] - place[a]
        away += u * u
        along += u * v
        square += v * v
    r = max(np.sqrt(away), 1e-6)
    along /= r
    across = np.sqrt(max(square - along * along, 0.0))
    return bool(abs(along) < NEARER and across < ASIDE * width * r)


@compiled
def _believe(
    k: int,
    kept: NDArray[np.bool_],
    link: NDArray[np.int16],
    before: NDArray[np.int64],
    sight: Sight,
    lenses: Lenses,
    images: Images,
    windows: Windows,
) -> None:
    """Count for how many frames the thing of each kept zone (n,) of sensor k was followed."""
    first, own = images.first[k], lenses.link[k]
    mine = slice(first, first + len(kept))
    old, behind = windows.times[mine].copy(), windows.behind[mine].copy()
    begin, rode, lay = (
        windows.begin[mine].copy(),
        windows.rode[mine].copy(),
        windows.lay[mine].copy(),
    )
    longer, T = LONGER if windows.dirty[k] else 1.0, sight.T_base_link
    for i in range(len(kept)):
        slot, j = first + i, before[i]
        windows.times[slot] = 0
        if not kept[i]:
            continue
        p = sight.points[slot]
        local = _seen_from(T[own], p)
        windows.place[slot] = p
        if j >= 0:
            windows.begin[slot], windows.rode[slot], windows.lay[slot] = begin[j], rode[j], lay[j]
            windows.behind[slot] = behind[j]
        else:
            windows.behind[slot] = link[i] if link[i] >= 0 else own
            windows.begin[slot], windows.rode[slot] = p, local
            windows.lay[slot] = _seen_from(T[windows.behind[slot]], p)
        in_world = _apart(p, windows.begin[slot])
        for_body = _apart(_seen_from(T[windows.behind[slot]], p), windows.lay[slot])
        moved = min(_apart(local, windows.rode[slot]), for_body)
        away = _apart(local, lenses.origin[k])
        way = longer * (WAY + images.width[k] * away)
        if not windows.doubted[slot] or (j >= 0 and old[j] >= SURE):
            windows.times[slot] = SURE
        elif moved >= way and in_world <= LESS * moved:
            windows.times[slot] = old[j] + 1
        else:
            windows.times[slot] = min(old[j] + 1 if j >= 0 else 1, SURE - 1)


@compiled
def _seen_from(T: Array, p: Array) -> Array:
    """A point (3,) of the base frame in the frame at T (4, 4)."""
    out = np.zeros(3)
    for a in range(3):
        for b in range(3):
            out[a] += T[b, a] * (p[b] - T[b, 3])
    return out


@compiled
def _apart(a: Array, b: Array) -> float:
    """[m] between two points (3,)."""
    return float(np.sqrt(((a - b) ** 2).sum()))


@compiled
def _shows_itself(k: int, reports: Reports, lenses: Lenses) -> int:
    """1 if one zone of sensor k, and no more, sees something too near to be measured, as a window
    is, while a quarter of them sees something farther."""
    near, farther = 0, 0
    for slot in range(lenses.first[k], lenses.first[k + 1]):
        if reports.targets[slot] == 0 or lenses.worth[k, reports.status[slot]] == NOTHING:
            continue
        near += reports.distance[slot] < lenses.limits[k, 0]
        farther += reports.distance[slot] >= lenses.limits[k, 0]
    return 1 if near == 1 and 4 * farther >= lenses.first[k + 1] - lenses.first[k] else 0


@compiled
def _weigh(k: int, signs: int, first: int, last: int, stamp: float, windows: Windows) -> None:
    """Add the signs of a frame of sensor k, zones first..last, to those before; they fade while
    nothing is doubted."""
    passed = stamp - windows.stamp[k]
    if np.isfinite(passed) and not windows.doubted[first:last].any():
        windows.signs[k] *= np.exp(-passed / LASTS)
    windows.stamp[k] = stamp
    windows.signs[k] = min(windows.signs[k] + signs, 2.0 * MANY)
    if windows.signs[k] >= MANY - 0.5:
        windows.dirty[k] = True
    elif windows.signs[k] < FEW:
        windows.dirty[k] = False
