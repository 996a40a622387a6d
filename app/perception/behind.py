"""Which reports a dirty window may have made of the body behind them.

A zone that the body's outline passes through may get hardly any light from it, so that its report
may be drawn all the way to the window. One that the body fills is drawn by centimetres, the nearer
the body the fewer. What hangs on the body, and no ray meets, is as thin as an outline.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.casting import Aims
from app.perception.footprint import Fan
from app.perception.returns import Returns
from app.perception.uncertainty import WIDEST, Known

MORE = 2.0  # times the margin across the zone: what lies beyond the self filter's is doubtful
ROUGH = 0.4  # half widths more: two of `uncertainty.BODY` a quarter of a metre away
FARTHEST = 0.6  # [m] cover glass shows in nearer targets only, says the maker
DRAWN, MOST = 0.25, 0.06  # share of the distance and [m] of a surface that fills the zone
STEEP = 1.0  # tangent of the angle between a ray and a surface's normal: it sends little light back


@compiled
def aim_behind(sensors: NDArray[np.intp], asked: NDArray[np.bool_], fan: Fan, aims: Aims) -> None:
    """Let all rays stand for the zones of `sensors` (m,) that are `asked` (S,), none for others."""
    for k in sensors:
        for zone in range(fan.first[k], fan.first[k + 1]):
            aims.done[zone] = 0
            aims.rays[zone] = fan.looks[k, 1] if asked[zone] else 0
            if asked[zone]:
                wide = 1.0 + ROUGH + MORE * (aims.spread[zone] - 1.0)
                aims.spread[zone] = min(wide, WIDEST)


@compiled
def find_body_behind(
    sensors: NDArray[np.intp],
    asked: NDArray[np.bool_],
    reported: Array,
    known: Known,
    aims: Aims,
    returns: Returns,
    out: NDArray[np.int16],
) -> None:
    """Write which link, -1 for none, lies behind the report (S,) [m] of each `asked` zone (S,) of
    `sensors` (m,) with its outline, or hardly behind it: some rays meet it there, not all, or all
    on a steep surface, or not far behind. Those that it fills well behind need not be asked
    further."""
    first = np.searchsorted(known.sensor_of, sensors)
    last = np.searchsorted(known.sensor_of, sensors, side="right")
    for m in range(len(sensors)):
        for zone in range(first[m], last[m]):
            if not asked[zone]:
                continue
            behind, link, near, far = 0, -1, np.inf, 0.0
            for ray in range(aims.rays[zone]):
                d = returns.distance[zone, ray]
                if reported[zone] < d < FARTHEST:
                    behind += 1
                    link = returns.link[zone, ray] if d < near else link
                    near, far = min(near, d), max(far, d)
            size = 2.0 * aims.spread[zone] * known.half[sensors[m]] * near
            full = behind == aims.rays[zone] and far - near <= STEEP * size
            drawn = behind > 0 and (not full or hardly(near - reported[zone], near))
            out[zone] = link if drawn else -1
            asked[zone] = drawn or not full


@compiled
def hardly(gap: float, body: float) -> bool:
    """Does a report lie hardly before the body, by a gap [m], that fills its zone at [m]?"""
    return 0.0 <= gap <= min(DRAWN * body, MOST)
