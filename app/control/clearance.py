"""How far the arm is from itself and from the known, static cell.

Links are capsules. Links that are neighbours, or that some part of is always close, are no
pair: they cannot be kept apart. Long capsules are cut into pieces, each with a gap of its own
to the cell: the end of a link that cannot leave what the arm stands on does not hide the end
that can come down on it.

What counts is the robot and the cell, never the posture it begins in: a capsule and a part of
the cell are no pair only if they are too close in every posture there is.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import NOTHING_LEARNED, Learned
from app.cell.parts import Cell
from app.control.capsules import fit_capsules
from app.control.cell_gaps import Parts, always_in, cell_within, times_near_cell
from app.control.cubes import make_cubes
from app.control.gaps import KEPT, Gaps, Pieces
from app.control.link_gaps import links_within, times_near
from app.robot.model import Robot
from app.robot.posture import Posture

CLOSE = 0.03  # [m] links that are as near as this in most postures are no pair
SAMPLES = 300  # random postures that tell
ALWAYS = 0.3  # share of them from which on a pair of links is left out
LONGEST = 0.25  # [m] of a piece
NO_CAPSULE = np.empty(0, dtype=np.int64)


class Clearance:
    """The robot's own gaps and those to the cell, at a posture.

    pieces: the links' capsules.   pairs: (p, 2) pairs of links that are kept apart.
    parts:  the cell's.   cell_cases: (c, 2) a capsule and a part of the cell.
    """

    def __init__(self, robot: Robot, cell: Cell | None = None) -> None:
        cell = cell or Cell()
        self.pieces, self.parts = _pieces(robot), _parts(cell)
        self._lasting = len(cell.boxes) + len(cell.planes)  # parts that are always there
        self._moves = np.isin(self.pieces.link, np.flatnonzero(robot.supports.any(axis=1)))
        self.pairs = _all_pairs(robot)
        self.cell_cases = _cases(np.flatnonzero(self._moves), np.arange(self._lasting))
        self._postures = _random_postures(robot)
        self._drop_always_close()
        self._known = self.cell_cases
        self.know(cell.learned)

    def know(self, learned: Learned) -> None:
        """From now on this is what was learned, instead of what was before."""
        cubes = make_cubes(learned)
        never = np.empty(len(self.pieces.link), dtype=np.bool_)
        always_in(self._postures, self.pieces, cubes, never)
        free = np.flatnonzero(self._moves & ~never) if len(learned) else NO_CAPSULE
        self.parts = self.parts._replace(cubes=cubes)
        self.cell_cases = np.concatenate((self._known, _cases(free, np.array([self._lasting]))))

    def measure(self, posture: Posture, within: float, links_within: float | None = None) -> Gaps:
        """Every gap below `within` [m]: one for two links, then one for a capsule and a part.

        links_within: [m] another limit for links.
        """
        T, near = posture.T_base_link, within if links_within is None else links_within
        own, cell = self._own(T, near), self._cell(T, within)
        cell.who[:, 0] += len(self.pairs)
        return Gaps._make(np.concatenate(both) for both in zip(own, cell, strict=True))

    def _own(self, T_base_link: NDArray[np.float64], within: float) -> Gaps:
        return Gaps(*links_within(T_base_link, self.pieces, self.pairs, within))

    def _cell(self, T_base_link: NDArray[np.float64], within: float) -> Gaps:
        return Gaps(*cell_within(T_base_link, self.pieces, self.cell_cases, self.parts, within))

    def _drop_always_close(self) -> None:
        """Leave out links that are close in many postures, and what can never leave the cell."""
        T = self._postures
        near = times_near(T, self.pieces, self.pairs, CLOSE)
        inside = times_near_cell(T, self.pieces, self.cell_cases, self.parts, KEPT)
        self.pairs = self.pairs[near < ALWAYS * SAMPLES]
        self.cell_cases = self.cell_cases[inside < SAMPLES]


@lru_cache(maxsize=8)
def _random_postures(robot: Robot) -> NDArray[np.float64]:
    """T_base_link (SAMPLES, L, 4, 4) of postures all over the joints' ranges."""
    rng = np.random.default_rng(0)
    low, high = np.maximum(robot.q_min, -np.pi), np.minimum(robot.q_max, np.pi)
    return np.array([robot.posture(rng.uniform(low, high)).T_base_link for _ in range(SAMPLES)])


def _pieces(robot: Robot) -> Pieces:
    """The links' capsules, long ones cut."""
    c = fit_capsules(robot.bodies)
    count = np.ceil(np.linalg.norm(c.b - c.a, axis=1) / LONGEST).astype(np.int64)
    pieces = [(i, k / n, (k + 1) / n) for i, n in enumerate(np.maximum(count, 1)) for k in range(n)]
    of = np.array([i for i, _, _ in pieces])
    share = np.array([[s, t] for _, s, t in pieces])[:, :, None]
    link = c.link[of].astype(np.int64)
    return Pieces(
        ends=(1.0 - share) * c.a[of, None] + share * c.b[of, None],
        radius=c.radius[of],
        link=link,
        first=np.searchsorted(link, np.arange(len(robot.links) + 1)),
    )


def _parts(cell: Cell) -> Parts:
    T = np.array([p.T_base_plane for p in cell.planes]).reshape(-1, 4, 4)
    height = (T[:, :3, 2] * T[:, :3, 3]).sum(axis=1)
    return Parts(
        T_box_base=np.array([np.linalg.inv(b.T_base_box) for b in cell.boxes]).reshape(-1, 4, 4),
        half=np.array([b.size / 2.0 for b in cell.boxes]).reshape(-1, 3),
        plane=np.column_stack((T[:, :3, 2], height)),
        cubes=make_cubes(NOTHING_LEARNED),
    )


def _all_pairs(robot: Robot) -> NDArray[np.int64]:
    """All two links but neighbours, which one joint is between."""
    one, two = np.triu_indices(len(robot.links), k=1)
    apart = (robot.supports[one] != robot.supports[two]).sum(axis=1) > 1
    return np.stack((one[apart], two[apart]), axis=1)


def _cases(capsules: NDArray[np.intp], parts: NDArray[np.intp]) -> NDArray[np.int64]:
    """(c, 2) every one of these capsules with every one of these parts."""
    return np.stack((np.repeat(capsules, len(parts)), np.tile(parts, len(capsules))), axis=1)
