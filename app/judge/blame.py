"""Whose fault is a touch? Asked at the first moment, half a second before, and ever after.

At a moment the arm could have avoided the touch where it knew of it (the touched link's own
distance was perceived within `TRUE` of the truth) and could give way (`app.judge.free_direction`):
the touched link from what touched it, however far that still was, and all links from what was near.
By the rule of the first moment that is asked once, `AHEAD` before the touch: an arm that then
waits until there is no way out is to blame. By the rule of every moment both must have been so
all the time until the touch, which excuses that arm. Both are asked of every controller alike.
"""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from app.judge.free_direction import NEAR, free_direction, motion_between
from app.judge.truth import TrueDistance, TruePair
from app.messages import Array, BodyPose, Pairs
from app.robot.model import Robot
from app.world.shapes import Shape

AHEAD = 0.5  # [s] before a touch it is asked first
TRUE = 0.10  # [m] perceived minus true distance up to which a link's distance counts as known


class Cause(StrEnum):
    """Why a touch was not avoided."""

    NOT_SEEN = "not seen"
    NO_WAY = "no free direction"
    AVOIDABLE = "avoidable"


class Moment(NamedTuple):
    """The truth at one time, and what was believed of it.

    q: (n,) true joint positions.   T_base_link: (L, 4, 4) true poses of the links.
    bodies: true poses of the world's.   seen: (L,) [m] perceived distance of each link.
    """

    stamp: float
    q: Array
    T_base_link: Array
    bodies: tuple[BodyPose, ...]
    seen: Array


class Blame(NamedTuple):
    """The cause by the rule of the first moment, and by that of every moment."""

    first: Cause
    every: Cause


def seen_distances(pairs: Pairs, links: int) -> Array:
    """(L,) [m] smallest perceived distance of each link, +inf where none is."""
    seen = np.full(links, np.inf)
    np.minimum.at(seen, pairs.link, pairs.distance)
    return seen


class Judgement:
    """Knows an arm as it is and the shapes of its world.

    speed: share of the joints' velocity limits that the arm may use.
    """

    def __init__(
        self, robot: Robot, truth: TrueDistance, shapes: Mapping[str, Shape], speed: float
    ) -> None:
        self._robot, self._truth, self._shapes, self._speed = robot, truth, shapes, speed

    def blame(self, past: Sequence[Moment], link: int) -> Blame:
        """Why `link` touched something at the last moment of `past`, which begins `AHEAD` of it."""
        seen = [self._seen(m, link) for m in past]
        body = min(self._pairs_of(past[-1], link), key=lambda p: p.distance).body
        free = [self._free(a, b, link, body) for a, b in pairwise(past)] or [False]
        return Blame(cause(seen[0], free[0]), cause(all(seen), all(free)))

    def phantom(self, past: Sequence[Moment]) -> float:
        """[m] by how much something was believed to be nearer to a moving link than anything
        was, at most; an arm that flees from a phantom may run into a thing."""
        links = np.flatnonzero(self._robot.supports.any(axis=1))
        return max(self._true(m, int(i)) - float(m.seen[i]) for m in past for i in links)

    def _seen(self, m: Moment, link: int) -> bool:
        return float(m.seen[link]) - self._true(m, link) <= TRUE

    def _true(self, m: Moment, link: int) -> float:
        """[m] true distance of a link."""
        T = m.T_base_link[link]
        return min(
            self._truth.pair(link, T, self._shapes[b.view.name], b.T_base_body, np.inf)
            for b in m.bodies
        )

    def _pairs_of(self, m: Moment, link: int) -> list[TruePair]:
        """The pairs of one link with every body."""
        pairs = self._truth.near_pairs(m.T_base_link, self._shapes, m.bodies, np.inf)
        return [p for p in pairs if p.link == link]

    def _free(self, a: Moment, b: Moment, link: int, body: str) -> bool:
        """Was there a way out at `a`, for the speed at which the bodies came until `b`?"""
        pairs = self._truth.near_pairs(a.T_base_link, self._shapes, a.bodies, NEAR)
        passed = b.stamp - a.stamp
        motions = {
            was.view.name: motion_between(was.T_base_body, is_.T_base_body, passed)
            for was, is_ in zip(a.bodies, b.bodies, strict=True)
        }
        touched = [p for p in self._pairs_of(a, link) if p.body == body]
        return free_direction(self._robot, a.q, pairs, motions, self._speed, touched)


def cause(seen: bool, free: bool) -> Cause:
    """What kept an arm from avoiding a touch."""
    if not seen:
        return Cause.NOT_SEEN
    return Cause.AVOIDABLE if free else Cause.NO_WAY
