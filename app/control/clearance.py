"""How far the arm is from itself and from the known, static cell.

Links are capsules. Links that are neighbours, or that some part of is always close, are no
pair: they cannot be kept apart. Against the cell long capsules are cut into pieces, each with
a gap of its own: the end of a link that cannot leave what the arm stands on does not hide the
end that can come down on it.

What counts is the robot and the cell, never the posture it begins in: a piece and a part of
the cell are no pair only if they are too close in every posture there is.
"""

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import NOTHING_LEARNED, Learned
from app.cell.parts import Cell
from app.control.capsules import fit_capsules
from app.control.cubes import make_cubes
from app.control.gaps import KEPT, Body, Cases, Gaps, Parts, measure, stuck
from app.robot.model import Robot
from app.robot.posture import Posture

CLOSE = 0.03  # [m] links that are as near as this in most postures are no pair
SAMPLES = 300  # random postures that tell
ALWAYS = 0.3  # share of them from which on a pair of links is left out
LONGEST = 0.25  # [m] of a piece


class Clearance:
    """The robot's own gaps and those to the cell, at a posture."""

    def __init__(self, robot: Robot, cell: Cell | None = None) -> None:
        cell = cell or Cell()
        self._body, self._parts = _body(robot), _parts(cell)
        self._pairs = _all_pairs(robot, self._body, cell)
        self._movable = self._pairs.learned
        self._cubes = make_cubes(NOTHING_LEARNED)
        self._drop_always_close(robot)
        self.know(cell.learned)

    @property
    def pairs(self) -> NDArray[np.int64]:
        """(p, 2) pairs of links that are kept apart."""
        return self._pairs.links

    def know(self, learned: Learned) -> None:
        """From now on this is what was learned, instead of what was before."""
        self._cubes = make_cubes(learned)
        always = np.empty(len(self._body.of), dtype=np.bool_)
        stuck(self._postures, self._body, self._cubes, always)
        self._pairs = self._pairs._replace(learned=self._movable[~always[self._movable]])

    def measure(self, posture: Posture, within: float) -> Gaps:
        """Every gap below `within` [m]: one for two links, one for a piece and a part."""
        most = sum(map(len, self._pairs))
        numbers, places = np.empty((4, most), dtype=np.int64), np.empty((3, most, 3))
        gaps = Gaps._make((*numbers, np.empty(most), *places))
        n = measure(
            posture.T_base_link, self._body, self._pairs, self._parts, self._cubes, within, gaps
        )  # fmt: skip
        return Gaps._make(column[:n] for column in gaps)

    def _drop_always_close(self, robot: Robot) -> None:
        """Leave out links that are close in many postures, and what can never leave the cell."""
        rng = np.random.default_rng(0)
        low, high = np.maximum(robot.q_min, -np.pi), np.minimum(robot.q_max, np.pi)
        pairs, poses = self._pairs, []
        links, boxes, planes = map(len, pairs[:3])
        close = np.zeros(links + boxes + planes)
        for _ in range(SAMPLES):
            posture = robot.posture(rng.uniform(low, high))
            poses.append(posture.T_base_link)
            gaps = self.measure(posture, CLOSE)
            close[gaps.pair[(gaps.b >= 0) | (gaps.distance < KEPT)]] += 1
        self._postures = np.array(poses)
        apart = np.split(close < SAMPLES, (links, links + boxes))
        apart[0] = close[:links] < ALWAYS * SAMPLES
        kept = [case[keep] for case, keep in zip(pairs[:3], apart, strict=True)]
        self._pairs = Cases._make((*kept, pairs.learned))


def _body(robot: Robot) -> Body:
    c = fit_capsules(robot.bodies)
    length = np.linalg.norm(c.b - c.a, axis=1)
    count = np.maximum(np.ceil(length / LONGEST), 1).astype(np.int64)
    of = np.repeat(np.arange(len(count)), count)
    cut = [(k / n, (k + 1) / n) for n in count for k in range(n)]
    return Body(
        ends=np.stack((c.a, c.b), axis=1),
        radius=c.radius.copy(),
        link=c.link.astype(np.int64),
        first=np.searchsorted(c.link, np.arange(len(robot.links) + 1)),
        of=of,
        share=np.array(cut),
    )


def _parts(cell: Cell) -> Parts:
    T = np.array([p.T_base_plane for p in cell.planes]).reshape(-1, 4, 4)
    height = (T[:, :3, 2] * T[:, :3, 3]).sum(axis=1)
    return Parts(
        T_box_base=np.array([np.linalg.inv(b.T_base_box) for b in cell.boxes]).reshape(-1, 4, 4),
        half=np.array([b.size / 2.0 for b in cell.boxes]).reshape(-1, 3),
        plane=np.column_stack((T[:, :3, 2], height)),
    )


def _all_pairs(robot: Robot, body: Body, cell: Cell) -> Cases:
    """All but neighbours, which one joint is between, and what no joint moves."""
    one, two = np.triu_indices(len(robot.links), k=1)
    apart = (robot.supports[one] != robot.supports[two]).sum(axis=1) > 1
    moves = np.flatnonzero(robot.supports.any(axis=1))
    pieces = np.flatnonzero(np.isin(body.link[body.of], moves))
    return Cases(
        links=np.stack((one[apart], two[apart]), axis=1),
        boxes=_each_with_each(pieces, len(cell.boxes)),
        planes=_each_with_each(pieces, len(cell.planes)),
        learned=pieces,
    )


def _each_with_each(pieces: NDArray[np.int64], parts: int) -> NDArray[np.int64]:
    """(pieces x parts, 2) every pair of a piece and the number of a part."""
    return np.stack((np.repeat(pieces, parts), np.tile(np.arange(parts), len(pieces))), axis=1)
