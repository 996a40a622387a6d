"""What is watched right before the skin: points at some height over each patch.

First sight asks when a thing on its way was seen; this asks whether it still is when it has come
so near.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.coverage.cones import packed
from app.coverage.look import Look, Subject
from app.coverage.volume import watched
from app.messages import Array

DEEP = 0.15  # [m] no point of a link is farther from its surface


class Near(NamedTuple):
    """Of H heights over P patches: counted (H, P) bool, whether the point is in the open, and
    sensors (H, P), how many of them see it."""

    counted: NDArray[np.bool_]
    sensors: NDArray[np.int64]


def near(subject: Subject, look: Look, heights: tuple[float, ...]) -> Near:
    """The points at `heights` [m] along the normals of the patches that are not covered; those
    within half the height of another link, or in it, do not count."""
    eyes = packed(subject.cones, look.views.free)
    open_, link = ~look.barred.all(axis=1), subject.patches.link
    counted, sensors = [], []
    for height in heights:
        points = look.at.point + height * look.at.normal
        counted.append(open_ & _clear(points, look, link, height / 2.0))
        sensors.append(watched(points, look.T_base_sensor, eyes).sum(axis=0))
    return Near(np.array(counted), np.array(sensors))


def _clear(points: Array, look: Look, link: NDArray[np.int64], least: float) -> NDArray[np.bool_]:
    """(P,) bool: is a point over a patch this far from all other links, and outside them?"""
    out = np.ones(len(points), dtype=np.bool_)
    for i in np.unique(link):
        others, mine = np.flatnonzero(link != i), link == i
        if not len(others):
            continue
        tree = KDTree(look.at.point[others])
        distance, nearest = map(
            np.asarray, tree.query(points[mine], distance_upper_bound=max(DEEP, least))
        )
        close = np.isfinite(distance)  # behind a patch that is far away is no inside
        patch, at = others[nearest[close]], np.flatnonzero(mine)[close]
        away = points[at] - look.at.point[patch]
        outside = np.einsum("pi,pi->p", away, look.at.normal[patch]) > 0.0
        out[at] = (distance[close] >= least) & outside
    return out
