"""Wedges between neighbouring sensors of a ring, where neither of the two sees."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.coverage.cones import packed
from app.coverage.look import Look, Subject
from app.coverage.volume import watched
from app.messages import Array

STEP = 0.001  # [m]


class Wedge(NamedTuple):
    """Between two neighbours, how far out from the circle of their lenses [m] it closes: by the
    two of them, and by all sensors at this posture; +inf: never within reach."""

    first: str
    second: str
    closes: float
    with_all: float


def wedges(subject: Subject, look: Look) -> tuple[Wedge, ...]:
    """The wedges of all rings, which are sensors called NAME-number on one link, three or more."""
    rings: dict[tuple[str, str], list[int]] = {}
    for k, s in enumerate(subject.skin.sensors):
        rings.setdefault((s.name.rpartition("-")[0], s.link), []).append(k)
    eyes = packed(subject.cones, look.views.free)
    out = []
    for (name, _), ring in rings.items():
        if not name or len(ring) < 3:
            continue
        lens = look.T_base_sensor[ring, :3, 3]
        centre = lens.mean(axis=0)
        radius = float(np.linalg.norm(lens - centre, axis=1).mean())
        for a, b in zip(range(len(ring)), [*range(1, len(ring)), 0], strict=True):
            way = (lens[a] + lens[b]) / 2.0 - centre
            way /= np.linalg.norm(way)
            far = np.arange(0.0, float(subject.cones.reach[ring].max()), STEP)
            seen = watched(centre + (radius + far[:, None]) * way, look.T_base_sensor, eyes)
            two = seen[ring[a]] | seen[ring[b]]
            first, second = (subject.skin.sensors[ring[i]].name for i in (a, b))
            every = np.asarray(seen.any(axis=0))
            out.append(Wedge(first, second, _first(two, far), _first(every, far)))
    return tuple(out)


def _first(seen: NDArray[np.bool_], far: Array) -> float:
    return float(far[seen.argmax()]) if seen.any() else float("inf")
