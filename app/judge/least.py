"""The least true distance, of a whole run or at a time, for a few exact measurements."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.judge.bounds import PairBounds
from app.judge.truth import TrueDistance
from app.messages import Array, BodyPose
from app.robot.model import Robot
from app.world.shapes import Shape
from app.world.world import World


class Nearest(NamedTuple):
    """distance: [m], zero or less on contact.   link: row of the body links, -1 of none.
    on_body: (3,) [m] the body's nearest point, base frame; None of none."""

    distance: float
    link: int
    body: str
    on_body: Array | None


NOTHING = Nearest(np.inf, -1, "", None)


class LeastDistance:
    """Watches `links` (rows of the robot's body links) and the bodies that `world` now has.

    While a pair cannot be below the least distance so far, it is left alone.
    leave_out: names of bodies that do not count.
    """

    def __init__(
        self, truth: TrueDistance, robot: Robot, links: NDArray[np.intp], world: World,
        leave_out: Collection[str] = (),
    ) -> None:  # fmt: skip
        self.least = np.inf  # [m] so far; zero or less on contact, and then no depth
        self._truth, self._links = truth, links
        self._rows, self._shapes = _counting(world, leave_out)
        self._bounds = PairBounds(robot, links, len(self._rows))

    def update(self, T_base_link: Array, bodies: Sequence[BodyPose]) -> float:
        """The least distance [m] until now, with links at T_base_link (L, 4, 4), all of them,
        and all bodies of the world."""
        T_link, there = T_base_link[self._links], [bodies[i] for i in self._rows]
        bound = self._bounds.now(T_link, there)
        for pair in np.argsort(bound, axis=None):
            i, j = divmod(int(pair), len(there))
            needed = max(self.least, 0.0)
            if bound[i, j] > needed:
                break
            link, T_body = int(self._links[i]), there[j].T_base_body
            d = self._truth.pair(link, T_link[i], self._shapes[j], T_body, needed)
            self.least = min(self.least, d)
            self._bounds.measured(i, j, d)
        return self.least


class NearestNow:
    """The nearest of `links` and of the bodies of `world` at every update.

    leave_out: names of bodies that do not count, such as those of the known cell.
    """

    def __init__(
        self, truth: TrueDistance, robot: Robot, links: NDArray[np.intp], world: World,
        leave_out: Collection[str] = (),
    ) -> None:  # fmt: skip
        self._truth, self._links = truth, links
        self._rows, self._shapes = _counting(world, leave_out)
        self._bounds = PairBounds(robot, links, len(self._rows))
        self._last = 0  # the pair that was nearest; mostly it still is, and bounds all others

    def update(self, T_base_link: Array, bodies: Sequence[BodyPose]) -> Nearest:
        """With links at T_base_link (L, 4, 4), all of them, and all bodies of the world."""
        T_link, there = T_base_link[self._links], [bodies[i] for i in self._rows]
        bound = self._bounds.now(T_link, there)
        order = np.argsort(bound, axis=None).tolist()
        if order:
            order.insert(0, order.pop(order.index(self._last)))
        best = NOTHING
        for pair in order:
            i, j = divmod(pair, len(there))
            if bound[i, j] >= best.distance:
                break
            link, T_body = int(self._links[i]), there[j].T_base_body
            d, at = self._truth.pair_with_point(
                link, T_link[i], self._shapes[j], T_body, best.distance
            )
            self._bounds.measured(i, j, d)
            if d < best.distance:
                best, self._last = Nearest(d, link, there[j].view.name, at), pair
        return best


def _counting(world: World, leave_out: Collection[str]) -> tuple[list[int], list[Shape]]:
    """Rows and shapes of the bodies that count."""
    shapes = world.shapes()
    rows = [i for i, name in enumerate(shapes) if name not in leave_out]
    return rows, [list(shapes.values())[i] for i in rows]
