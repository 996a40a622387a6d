"""Coverage over many postures: sums for each patch and each sensor, and what they come to."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.coverage.look import Look, Subject
from app.coverage.near import near
from app.coverage.volume import Space
from app.messages import Array

WITHIN = (0.05, 0.1, 0.2, 0.3)  # [m] gaps by which what comes should have been seen
BLIND = 0.1  # [m] a way is blind where nothing was seen at this gap
COST = 0.2  # [m] the gap by which the loss of a sensor is told
LATENCY = 0.05  # [s] from a measurement to the host


@dataclass(eq=False)
class Tally:
    """Sums over looks at a subject; what comes has `speed` [m/s].

    open, gap, time: (P,) ways that are free, their gaps [m] and times to contact [s].
    near, watched, twice: (W, P) postures in which the point at each of `WITHIN` over a patch
    counts; a sensor sees it; two do.
    seen: (W, P) ways that are seen at each of `WITHIN`.   worst: (P,) [m] the least gap of all.
    blind: (P,) postures in which something can come unseen to within `BLIND`.
    alone: (K,) area x ways that nobody but this sensor sees at `COST`.
    hidden, lost: (K,) postures in which it looks into the arm; share of its cone that is lost.
    space: of each posture: blind near, blind far, sensed, occupancy.
    """

    subject: Subject
    speed: float
    looks: int = 0
    open: Array = field(init=False)
    gap: Array = field(init=False)
    time: Array = field(init=False)
    seen: Array = field(init=False)
    near: Array = field(init=False)
    watched: Array = field(init=False)
    twice: Array = field(init=False)
    worst: Array = field(init=False)
    blind: Array = field(init=False)
    alone: Array = field(init=False)
    hidden: Array = field(init=False)
    lost: Array = field(init=False)
    space: list[tuple[float, ...]] = field(default_factory=list)

    def __post_init__(self) -> None:
        patches, sensors = len(self.subject.patches.link), self.subject.skin.count
        self.open, self.gap, self.time = np.zeros((3, patches))
        self.seen, self.near, self.watched, self.twice = np.zeros((4, len(WITHIN), patches))
        self.worst, self.blind = np.full(patches, np.inf), np.zeros(patches)
        self.alone, self.hidden, self.lost = np.zeros((3, sensors))

    def add(self, look: Look, space: Space) -> None:
        """One more posture."""
        gap, free = look.seen(), ~look.barred
        known = np.where(free, gap, 0.0)
        self.looks += 1
        self.open += free.sum(axis=1)
        self.gap += known.sum(axis=1)
        self.time += np.where(free, self.times(look), 0.0).sum(axis=1)
        for i, d in enumerate(WITHIN):
            self.seen[i] += (known >= d).sum(axis=1)
        worst = np.where(free, gap, np.inf).min(axis=1)
        self.worst, self.blind = np.minimum(self.worst, worst), self.blind + (worst < BLIND)
        before = near(self.subject, look, WITHIN)
        self.near += before.counted
        self.watched += before.counted & (before.sensors >= 1)
        self.twice += before.counted & (before.sensors >= 2)
        sees = look.gap >= COST
        only: NDArray[np.bool_] = sees & (sees.sum(axis=0, dtype=np.int16) == 1)
        self.alone += only.sum(axis=2) @ self.subject.patches.area
        self.hidden += look.hidden
        first = self.subject.skin.first
        self.lost += np.add.reduceat(look.views.lost, first[:-1]) / np.diff(first)
        self.space.append((space.blind_near, space.blind_far, space.sensed, space.occupancy))

    def times(self, look: Look) -> Array:
        """(P, M) [s] from when the host knows of what comes to its contact, at worst: the frame in
        which it is first seen may come a period later. 0: never in time."""
        best = np.zeros(look.barred.shape)
        periods = np.array([s.type.period for s in self.subject.skin.sensors])
        for period in np.unique(periods):
            gap = look.gap[periods == period].max(axis=0)
            best = np.maximum(best, gap / self.speed - period - LATENCY)
        return best

    def row(self, name: str, of: NDArray[np.bool_]) -> dict[str, Any]:
        """Figures of the patches `of` (P,), weighted by their area and their free ways."""
        area, some = self.subject.patches.area, of & (self.open > 0)
        ways, whole = float(area @ (self.open * some)), float(area[some].sum())
        if not ways:
            return {"name": name, "patches": 0}
        over = np.maximum(self.near[:, some] @ area[some], 1e-12)
        shares = {
            "seen": self.seen[:, some] @ area[some] / ways,
            "watched": self.watched[:, some] @ area[some] / over,
            "twice": self.twice[:, some] @ area[some] / over,
        }
        return {
            "name": name,
            "patches": int(some.sum()),
            "area_m2": whole,
            **{
                f"{what}_{100 * d:.0f}cm": float(s)
                for what, share in shares.items()
                for d, s in zip(WITHIN, share, strict=True)
            },
            "gap_m": float(area[some] @ self.gap[some]) / ways,
            "time_s": float(area[some] @ self.time[some]) / ways,
            "blind_area": float(area[some] @ self.blind[some]) / whole / self.looks,
            "never_seen": float(area[some & (self.gap <= 0.0)].sum()) / whole,
        }

    @property
    def moving(self) -> NDArray[np.bool_]:
        """(P,) which patches a joint can move: the base stays where it is."""
        links = np.asarray(self.subject.robot.supports.any(axis=1))
        return np.asarray(links[self.subject.patches.link])

    def rows(self) -> list[dict[str, Any]]:
        """A row each link, and one of all that moves."""
        links = self.subject.robot.links
        out = [self.row(n, self.subject.patches.link == i) for i, n in enumerate(links)]
        return [*out, self.row("all that moves", self.moving)]

    def sensor_rows(self) -> list[dict[str, Any]]:
        """A row each sensor: what its loss costs of what is seen at `COST`, and what it sees."""
        ways = float(self.subject.patches.area @ self.open)
        return [
            {
                "name": s.name,
                f"costs_{100 * COST:.0f}cm": float(self.alone[k]) / ways,
                "lost_cone": float(self.lost[k]) / self.looks,
                "hidden": float(self.hidden[k]) / self.looks,
            }
            for k, s in enumerate(self.subject.skin.sensors)
        ]

    def space_row(self) -> dict[str, Any]:
        """The space round the arm, mean over postures."""
        names = ("blind_0_to_0.5m", "blind_0.5_to_2m", "sensed_share", "occupancy_coverage")
        return {
            "name": "space",
            **dict(zip(names, np.mean(self.space, axis=0).tolist(), strict=True)),
        }
