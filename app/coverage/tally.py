"""Coverage over many postures: sums for each patch and each sensor, and what they come to."""

from typing import Any, NamedTuple

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


class Sums(NamedTuple):
    """Sums over looks.

    looks: how many.
    open, gap, time: (P,) ways that are free, their gaps [m] and times to contact [s].
    seen: (W, P) ways that are seen at each of `WITHIN`.
    near, watched, twice: (W, P) postures in which the point at each of `WITHIN` over a patch
    counts; a sensor sees it; two do.
    blind: (P,) postures in which something can come unseen to within `BLIND`.
    alone: (K,) area x ways of what moves that nobody but this sensor sees at `COST`.
    hidden, lost: (K,) postures in which it looks into the arm; share of its cone that is lost.
    space: (4,) blind near, blind far, sensed, occupancy.
    worst: (P,) [m] the least gap of all, no sum.
    """

    looks: int
    open: Array
    gap: Array
    time: Array
    seen: Array
    near: Array
    watched: Array
    twice: Array
    blind: Array
    alone: Array
    hidden: Array
    lost: Array
    space: Array
    worst: Array

    def plus(self, other: "Sums") -> "Sums":
        """Those of both."""
        mine: tuple[Any, ...] = self
        both = Sums._make(a + b for a, b in zip(mine, other, strict=True))
        return both._replace(worst=np.minimum(self.worst, other.worst))


def no_sums(patches: int, sensors: int) -> Sums:
    """Of no look yet."""
    one, each, per = np.zeros(patches), np.zeros((len(WITHIN), patches)), np.zeros(sensors)
    return Sums(
        0, one, one, one, each, each, each, each, one, per, per, per, np.zeros(4),
        np.full(patches, np.inf),
    )  # fmt: skip


class Tally:
    """Coverage of a subject over looks; what comes has `speed` [m/s]."""

    def __init__(self, subject: Subject, speed: float) -> None:
        self.subject, self.speed = subject, speed
        self.sums = no_sums(len(subject.patches.link), subject.skin.count)

    def add(self, look: Look, space: Space) -> None:
        """One more posture."""
        gap, free = look.seen(), ~look.barred
        known = np.where(free, gap, 0.0)
        worst = np.where(free, gap, np.inf).min(axis=1)
        before = near(self.subject, look, WITHIN)
        sees = look.gap >= COST
        only: NDArray[np.bool_] = sees & (sees.sum(axis=0, dtype=np.int16) == 1)
        first = self.subject.skin.first
        one = Sums(
            looks=1,
            open=free.sum(axis=1),
            gap=known.sum(axis=1),
            time=np.where(free, self.times(look), 0.0).sum(axis=1),
            seen=np.array([(known >= d).sum(axis=1) for d in WITHIN]),
            near=np.where(before.counted, 1.0, 0.0),
            watched=np.where(before.counted & (before.sensors >= 1), 1.0, 0.0),
            twice=np.where(before.counted & (before.sensors >= 2), 1.0, 0.0),
            blind=np.where(worst < BLIND, 1.0, 0.0),
            alone=only.sum(axis=2) @ (self.subject.patches.area * self.moving),
            hidden=np.where(look.hidden, 1.0, 0.0),
            lost=np.add.reduceat(look.views.lost, first[:-1]) / np.diff(first),
            space=np.array([space.blind_near, space.blind_far, space.sensed, space.occupancy]),
            worst=worst,
        )
        self.sums = self.sums.plus(one)

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
        area, some = self.subject.patches.area, of & (self.sums.open > 0)
        ways, whole = float(area @ (self.sums.open * some)), float(area[some].sum())
        if not ways:
            return {"name": name, "patches": 0}
        over = np.maximum(self.sums.near[:, some] @ area[some], 1e-12)
        shares = {
            "seen": self.sums.seen[:, some] @ area[some] / ways,
            "watched": self.sums.watched[:, some] @ area[some] / over,
        }
        twice = self.sums.twice[:, some] @ area[some] / over
        costly = WITHIN.index(COST)
        return {
            "name": name,
            "patches": int(some.sum()),
            "area_m2": whole,
            **{
                f"{what}_{100 * d:.0f}cm": float(s)
                for what, share in shares.items()
                for d, s in zip(WITHIN, share, strict=True)
            },
            f"twice_{100 * COST:.0f}cm": float(twice[costly]),
            "gap_m": float(area[some] @ self.sums.gap[some]) / ways,
            "time_s": float(area[some] @ self.sums.time[some]) / ways,
            "blind_area": float(area[some] @ self.sums.blind[some]) / whole / self.sums.looks,
            "never_seen": float(area[some & (self.sums.gap <= 0.0)].sum()) / whole,
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
        ways = float((self.subject.patches.area * self.moving) @ self.sums.open)
        return [
            {
                "name": s.name,
                f"costs_{100 * COST:.0f}cm": float(self.sums.alone[k]) / ways,
                "lost_cone": float(self.sums.lost[k]) / self.sums.looks,
                "hidden": float(self.sums.hidden[k]) / self.sums.looks,
            }
            for k, s in enumerate(self.subject.skin.sensors)
        ]

    def space_row(self) -> dict[str, Any]:
        """The space round the arm, mean over postures."""
        names = ("blind_0_to_0.5m", "blind_0.5_to_2m", "sensed_share", "occupancy_coverage")
        return {
            "name": "space",
            **dict(zip(names, (self.sums.space / self.sums.looks).tolist(), strict=True)),
        }
