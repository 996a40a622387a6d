"""What lies between the arm and the known cell, and is a mixture of both.

A zone that is crossed by the arm's outline, or by a hose, with the known cell behind, reports one
distance somewhere between them when they are nearer to each other than the sensor can tell apart.
In the same way the edge of a box of the cell, met with little light, is told a little before it.
So a kept zone is taken for the cell when

- it sees a thing of no more than `FEW` zones, for an arm or a post along the outline takes more; or
  a thin one behind what may hang on a link, for a hose is long, and
- its ray goes on into the known cell within its own threshold; or within what the sensor tells
  apart, when the arm, or what may hang on it, is as little before the report.

A thing of the world that comes there is seen by other zones as well, unless it is as thin as the
outline that it comes to.

Behind a dirty window the edge of a box is drawn nearer by far more, like the arm's own outline (see
`app.perception.windows`); so it tells which zones have one behind their report.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.behind import FARTHEST
from app.perception.hanging import Hanging
from app.perception.placing import Lenses
from app.perception.returns import Judgement
from app.perception.static_filter import StaticFilter
from app.perception.things import find_small
from app.perception.uncertainty import views_aside
from app.robot.posture import Posture
from app.robot.skin import Skin

BASE = 0  # the robot's first link
FEW = 3  # zones that a mixture takes: along an outline its distance differs from zone to zone
KEPT, STATIC = int(Verdict.KEPT), int(Verdict.STATIC)
CORNERS = np.array([(0.0, 0.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
MARGIN = 0.06  # [m] by which a known box is usually larger than what stands there


class Between:
    """Tells which kept points are mixtures.

    hanging: knows where the arm, or what hangs on it, may be in a zone's way.
    """

    def __init__(self, skin: Skin, lenses: Lenses, hanging: Hanging) -> None:
        self._sensor_of, self._lenses, self._hanging = skin.sensor_of, lenses, hanging
        self._apart = np.array([s.type.separate_m for s in skin.sensors])[skin.sensor_of]
        self._grid = skin.grid
        self._crossed = np.full(skin.slots, -1, dtype=np.int16)
        self._half = views_aside(skin) / np.sqrt(2.0)  # (K,) [rad] to a zone's side

    def mark(
        self,
        sensors: NDArray[np.intp],
        thin: NDArray[np.bool_],
        few: NDArray[np.bool_],
        points: Array,
        posture: Posture,
        judged: Judgement,
        cell: StaticFilter,
    ) -> None:
        """Turn KEPT into STATIC where a zone of `sensors` (m,) sees a mixture.

        thin, few: (S,) those that see something thin, and of `FEW` zones.   points: (S, 3) [m]
        base frame.
        """
        zones = self._chosen(sensors, thin, judged.verdict)
        if len(zones):
            reach = self._reach(sensors, zones, thin, points, posture, judged)
            mixed = few[zones] | (self._crossed[zones] >= 0)
            zones, reach = zones[mixed], reach[mixed]
            rays, _ = self._rays(zones, points, posture)
            met = cell.met(points[zones], rays, reach)
            judged.verdict[zones[met]] = STATIC

    def behind(
        self,
        sensors: NDArray[np.intp],
        asked: NDArray[np.bool_],
        points: Array,
        posture: Posture,
        judged: Judgement,
        cell: StaticFilter,
        dirty: NDArray[np.bool_],
        out: NDArray[np.int16],
    ) -> None:
        """Write to `out` (S,), where it is -1, which `asked` zones (S,) of `sensors` (m,) have an
        edge of the known cell behind their `points` (S, 3): some rays meet it, or the outermost
        would not if the cell were known without margins.

        dirty: (K,) which windows are. Behind these it is enough that some ray meets the cell, for
        none knows how little of it is really in view; and it is written that it is of what always
        stands, so that nothing small is believed before it. Else it is of the sensor's link.
        """
        zones = self._chosen(sensors, asked & (out < 0), judged.verdict)
        if not len(zones):
            return
        rays, distance = self._rays(zones, points, posture)
        begin, spread = _spread(rays, distance, points[zones], self._half[self._sensor_of[zones]])
        left = np.maximum(FARTHEST - distance, 0.0)
        met = cell.met(begin, spread, np.repeat(left, len(CORNERS)))
        met = met.reshape(-1, len(CORNERS))
        full = met.all(axis=1) & ~dirty[self._sensor_of[zones]]
        edge = zones[met.any(axis=1) & ~full]
        k = self._sensor_of[edge]
        out[edge] = np.where(dirty[k], BASE, self._lenses.link[k])

    def few(
        self, sensors: NDArray[np.intp], asked: NDArray[np.bool_], distance: Array,
        verdict: NDArray[np.uint8],
    ) -> NDArray[np.bool_]:  # fmt: skip
        """(S,) which of the `asked` zones (S,) of `sensors` (m,) see a thing of `FEW` zones."""
        return np.asarray(_few(sensors, asked, distance, verdict, self._lenses.first, self._grid))

    def _chosen(
        self, sensors: NDArray[np.intp], asked: NDArray[np.bool_], verdict: NDArray[np.uint8]
    ) -> NDArray[np.intp]:
        return _asked_and_kept(sensors, self._lenses.first, asked, verdict)

    def _reach(
        self, sensors: NDArray[np.intp], zones: NDArray[np.intp], asked: NDArray[np.bool_],
        points: Array, posture: Posture, judged: Judgement,
    ) -> Array:  # fmt: skip
        """(n,) [m] behind its report in which each zone may have seen the cell."""
        crossed, apart = self._crossed, self._apart[zones]
        crossed[zones] = -1
        self._hanging.before(sensors, asked, points, posture, float(apart.max()), crossed)
        gap = judged.gap[zones]  # to the body as it was modelled
        outline = (crossed[zones] >= 0) | ((gap < 0.0) & (gap > -apart))
        return np.where(outline, apart, judged.eps[zones])

    def _rays(
        self, zones: NDArray[np.intp], points: Array, posture: Posture
    ) -> tuple[Array, Array]:
        """(n, 3) unit vectors from the lenses through the points, and how far these are, (n,)."""
        return _rays_to(zones, self._sensor_of, points, posture.T_base_link, self._lenses)


@compiled
def _asked_and_kept(
    sensors: NDArray[np.intp],
    first: NDArray[np.int64],
    asked: NDArray[np.bool_],
    verdict: NDArray[np.uint8],
) -> NDArray[np.intp]:
    """(n,) the `asked` zones of `sensors` (m,) that are KEPT."""
    out, n = np.empty(len(asked), dtype=np.intp), 0
    for k in sensors:
        for zone in range(first[k], first[k + 1]):
            if asked[zone] and verdict[zone] == KEPT:
                out[n] = zone
                n += 1
    return out[:n]


@compiled
def _rays_to(
    zones: NDArray[np.intp],
    sensor_of: NDArray[np.int64],
    points: Array,
    T_base_link: Array,
    lenses: Lenses,
) -> tuple[Array, Array]:
    """(n, 3) unit vectors from the lenses of `zones` (n,) through their points, of (S, 3), and how
    far these are, (n,) [m]."""
    rays, length = np.empty((len(zones), 3)), np.empty(len(zones))
    for i in range(len(zones)):
        k, square = sensor_of[zones[i]], 0.0
        T, o = T_base_link[lenses.link[k]], lenses.origin[k]
        for a in range(3):  # summed as numpy's einsum does: older recordings verify to the last bit
            lens = T[a, 0] * o[0] + T[a, 2] * o[2] + T[a, 1] * o[1] + T[a, 3]
            rays[i, a] = points[zones[i], a] - lens
            square += rays[i, a] * rays[i, a]
        length[i] = max(np.sqrt(square), 1e-6)
        for a in range(3):
            rays[i, a] /= length[i]
    return rays, length


@compiled
def _spread(rays: Array, distance: Array, points: Array, half: Array) -> tuple[Array, Array]:
    """Where the five rays of a zone of `CORNERS` begin, `MARGIN` aside of its point, and whither
    they go, (5 n, 3) both.

    rays: (n, 3) unit, in the middle of the zones.   distance: (n,) [m] of their points (n, 3).
    half: (n,) [rad] to a zone's side.
    """
    n = len(rays)
    begin, spread = np.empty((5 * n, 3)), np.empty((5 * n, 3))
    across, down = np.empty(3), np.empty(3)
    for i in range(n):
        r, least = rays[i], 0
        for a in range(1, 3):
            if abs(r[a]) < abs(r[least]):
                least = a
        b, c = (least + 1) % 3, (least + 2) % 3
        across[least], across[b], across[c] = 0.0, r[c], -r[b]
        across /= np.sqrt(r[b] * r[b] + r[c] * r[c])
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            down[a] = r[b] * across[c] - r[c] * across[b]
        for corner in range(5):
            for a in range(3):
                side = CORNERS[corner, 0] * across[a] + CORNERS[corner, 1] * down[a]
                aside = side * half[i]
                spread[5 * i + corner, a] = r[a] + aside
                begin[5 * i + corner, a] = points[i, a] + distance[i] * aside + MARGIN * side
    return begin, spread


@compiled
def _few(
    sensors: NDArray[np.intp], asked: NDArray[np.bool_], distance: Array,
    verdict: NDArray[np.uint8], first: NDArray[np.int64], grid: NDArray[np.int64],
) -> NDArray[np.bool_]:  # fmt: skip
    """See `Between.few`."""
    out = np.zeros(len(asked), dtype=np.bool_)
    for k in sensors:
        mine = slice(first[k], first[k + 1])
        if asked[mine].any():
            small = np.empty(first[k + 1] - first[k], dtype=np.bool_)
            find_small(distance[mine], verdict[mine] == KEPT, FEW, grid[k], small)
            out[mine] = asked[mine] & small
    return out
