"""How far the arm is from itself and from the known, static cell.

Links are capsules. Links that are neighbours, or that some part of is always close, are no
pair: they cannot be kept apart. Long capsules are cut into pieces, each with a gap of its own
to the cell: the end of a link that cannot leave what the arm stands on does not hide the end
that can come down on it.

What counts is the robot and the cell, never the posture it begins in: a capsule and a part of
the cell are no pair only if they are too close in every posture there is.
"""

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import NOTHING_LEARNED, Learned
from app.cell.parts import Cell
from app.control.capsules import fit_capsules
from app.control.cubes import make_cubes
from app.control.gaps import KEPT, Body, Cases, Gaps, Parts, always_in, measure
from app.robot.model import Robot
from app.robot.posture import Posture

CLOSE = 0.03  # [m] links that are as near as this in most postures are no pair
SAMPLES = 300  # random postures that tell
ALWAYS = 0.3  # share of them from which on a pair of links is left out
LONGEST = 0.25  # [m] of a piece
NO_CAPSULE = np.empty(0, dtype=np.int64)


class Clearance:
    """The robot's own gaps and those to the cell, at a posture."""

    def __init__(self, robot: Robot, cell: Cell | None = None) -> None:
        cell = cell or Cell()
        self._body, self._parts = _body(robot), _parts(cell)
        self._lasting = len(cell.boxes) + len(cell.planes)  # parts that are always there
        self._cases = _all_cases(robot, self._body, self._lasting)
        self._drop_always_close(robot)
        self._known = self._cases.cell
        self.know(cell.learned)

    @property
    def pairs(self) -> NDArray[np.int64]:
        """(p, 2) pairs of links that are kept apart."""
        return self._cases.links

    def know(self, learned: Learned) -> None:
        """From now on this is what was learned, instead of what was before."""
        cubes = make_cubes(learned)
        never = np.empty(len(self._body.link), dtype=np.bool_)
        always_in(self._postures, self._body, cubes, never)
        free = np.flatnonzero(self._moves & ~never) if len(learned) else NO_CAPSULE
        more = np.column_stack((free, np.full(len(free), self._lasting)))
        self._parts = self._parts._replace(cubes=cubes)
        self._cases = self._cases._replace(cell=np.concatenate((self._known, more)))

    def measure(self, posture: Posture, within: float, links_within: float | None = None) -> Gaps:
        """Every gap below `within` [m]: one for two links, one for a capsule and a part.

        links_within: [m] another limit for links.
        """
        most = len(self._cases.links) + len(self._cases.cell)
        gaps = Gaps(np.empty((most, 4), np.int64), np.empty(most), np.empty((most, 3, 3)))
        n = measure(
            posture.T_base_link, self._body, self._cases, self._parts, within,
            within if links_within is None else links_within, gaps,
        )  # fmt: skip
        return Gaps(gaps.who[:n], gaps.distance[:n], gaps.where[:n])

    def _drop_always_close(self, robot: Robot) -> None:
        """Leave out links that are close in many postures, and what can never leave the cell."""
        rng = np.random.default_rng(0)
        low, high = np.maximum(robot.q_min, -np.pi), np.minimum(robot.q_max, np.pi)
        cases, poses = self._cases, []
        links = len(cases.links)
        close = np.zeros(links + len(cases.cell))
        for _ in range(SAMPLES):
            posture = robot.posture(rng.uniform(low, high))
            poses.append(posture.T_base_link)
            close[self.measure(posture, KEPT, CLOSE).pair] += 1
        self._postures = np.array(poses)
        self._moves = np.isin(self._body.link, np.flatnonzero(robot.supports.any(axis=1)))
        self._cases = Cases(
            cases.links[close[:links] < ALWAYS * SAMPLES], cases.cell[close[links:] < SAMPLES]
        )


def _body(robot: Robot) -> Body:
    """The links' capsules, long ones cut."""
    c = fit_capsules(robot.bodies)
    count = np.ceil(np.linalg.norm(c.b - c.a, axis=1) / LONGEST).astype(np.int64)
    pieces = [(i, k / n, (k + 1) / n) for i, n in enumerate(np.maximum(count, 1)) for k in range(n)]
    of = np.array([i for i, _, _ in pieces])
    share = np.array([[s, t] for _, s, t in pieces])[:, :, None]
    link = c.link[of].astype(np.int64)
    return Body(
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


def _all_cases(robot: Robot, body: Body, parts: int) -> Cases:
    """All but neighbours, which one joint is between, and what no joint moves."""
    one, two = np.triu_indices(len(robot.links), k=1)
    apart = (robot.supports[one] != robot.supports[two]).sum(axis=1) > 1
    moves = np.flatnonzero(robot.supports.any(axis=1))
    capsules = np.flatnonzero(np.isin(body.link, moves))
    return Cases(
        links=np.stack((one[apart], two[apart]), axis=1),
        cell=np.stack(
            (np.repeat(capsules, parts), np.tile(np.arange(parts), len(capsules))), axis=1
        ),
    )
