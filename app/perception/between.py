"""What lies between the arm and the known cell, and is a mixture of both.

A zone that is crossed by the arm's outline, or by a hose, with the known cell behind, reports one
distance somewhere between them when they are nearer to each other than the sensor can tell apart.
In the same way the edge of a box of the cell, met with little light, is told a little before it.
So a kept zone is taken for the cell when

- it is part of a thing that is nowhere two zones wide both ways, and
- its ray goes on into the known cell within its own threshold; or within what the sensor tells
  apart, when the arm, or what may hang on it, is as little before the report.

A thing of the world that comes there is seen by other zones as well, unless it is as thin as the
outline that it comes to.

Behind a dirty window the edge of a box is drawn nearer by far more, like the arm's own outline (see
`app.perception.windows`); so it tells which zones have one behind their report.
"""

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, Verdict
from app.perception.behind import FARTHEST
from app.perception.hanging import Hanging
from app.perception.placing import Lenses
from app.perception.returns import Judgement
from app.perception.static_filter import StaticFilter
from app.perception.uncertainty import views_aside
from app.robot.posture import Posture
from app.robot.skin import Skin

BASE = 0  # the robot's first link
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
        self._crossed = np.full(skin.slots, -1, dtype=np.int16)
        self._half = views_aside(skin) / np.sqrt(2.0)  # (K,) [rad] to a zone's side

    def mark(
        self,
        sensors: NDArray[np.intp],
        asked: NDArray[np.bool_],
        points: Array,
        posture: Posture,
        judged: Judgement,
        cell: StaticFilter,
    ) -> None:
        """Turn KEPT into STATIC where a zone of `sensors` (m,) sees a mixture.

        asked: (S,) those that see something thin.   points: (S, 3) [m] base frame.
        """
        zones = self._chosen(sensors, asked, judged.verdict)
        if len(zones):
            reach = self._reach(sensors, zones, asked, points, posture, judged)
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
        stands, so that nothing thin is believed before it. Else it is of the sensor's link.
        """
        zones = self._chosen(sensors, asked & (out < 0), judged.verdict)
        if not len(zones):
            return
        rays, distance = self._rays(zones, points, posture)
        across = np.cross(rays, np.eye(3)[np.argmin(np.abs(rays), axis=1)])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        sides = np.stack([across, np.cross(rays, across)], axis=1)  # (n, 2, 3)
        aside = CORNERS @ sides * self._half[self._sensor_of[zones], None, None]  # (n, 5, 3)
        spread = rays[:, None] + aside
        begin = points[zones, None] + distance[:, None, None] * aside + MARGIN * (CORNERS @ sides)
        left = np.maximum(FARTHEST - distance, 0.0)
        met = cell.met(begin.reshape(-1, 3), spread.reshape(-1, 3), np.repeat(left, len(CORNERS)))
        met = met.reshape(-1, len(CORNERS))
        full = met.all(axis=1) & ~dirty[self._sensor_of[zones]]
        edge = zones[met.any(axis=1) & ~full]
        k = self._sensor_of[edge]
        out[edge] = np.where(dirty[k], BASE, self._lenses.link[k])

    def _chosen(
        self, sensors: NDArray[np.intp], asked: NDArray[np.bool_], verdict: NDArray[np.uint8]
    ) -> NDArray[np.intp]:
        mine = np.isin(self._sensor_of, sensors)
        return np.flatnonzero(mine & asked & (verdict == KEPT))

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
        k, lenses = self._sensor_of[zones], self._lenses
        T = posture.T_base_link[lenses.link[k]]
        lens = np.einsum("nij,nj->ni", T[:, :3, :3], lenses.origin[k]) + T[:, :3, 3]
        ray = points[zones] - lens
        length = np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
        return ray / length[:, None], length
