"""Spheres thrown at the arm before its simulated sensors: the judge of what is predicted.

A sphere is moved along its line from afar, in steps, until a zone of an ideal world reports it.
The simulated sensors (`app.sensing`) and the prediction have nothing in common but the layout.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.coverage.look import Look, Subject
from app.messages import Array
from app.robot.posture import Posture
from app.sensing.budget import IDEAL
from app.sensing.sight import Sight, eyes_of
from app.sensing.truth import draw_truth
from app.world.world import WORLD, World

STEP = 0.02  # [m] of a sphere on its way
NAME = "thrown"


class Throws(NamedTuple):
    """n spheres thrown at patches, with the gap [m] at which each is first seen, 0: never.

    patch, way: (n,) which.   predicted, simulated: (n,) [m].
    footprint: (n,) [m] of a zone where the sphere is when it is first seen, by either.
    """

    patch: NDArray[np.int64]
    way: NDArray[np.int64]
    predicted: Array
    simulated: Array
    footprint: Array

    @property
    def agreed(self) -> NDArray[np.bool_]:
        """(n,) are the two within a zone's footprint and a step of each other?"""
        return np.asarray(np.abs(self.predicted - self.simulated) <= self.footprint + STEP)


def throw(
    subject: Subject, look: Look, posture: Posture, count: int, seed: int,
    told: Callable[[], None] = lambda: None,
) -> Throws:  # fmt: skip
    """Throw `count` spheres at patches drawn by their area, from directions that are free."""
    rng = np.random.default_rng(seed)
    open_ = np.argwhere(~look.barred)
    share = subject.patches.area[open_[:, 0]]
    patch, way = open_[rng.choice(len(open_), count, p=share / share.sum())].T
    sight, world = _before(subject)
    simulated, lens = np.zeros(count), np.full((count, 3), np.nan)
    reach = subject.cones.reach
    for i in range(count):
        x, u = look.at.point[patch[i]], look.at.direction[patch[i], way[i]]
        for gap in np.arange(subject.far, -STEP / 2.0, -STEP):
            world.move(NAME, _at(x + (gap + subject.radius) * u))
            k = _first(sight, posture, reach)
            if k >= 0:
                simulated[i], lens[i] = gap, look.T_base_sensor[k, :3, 3]
                break
        told()
    predicted = look.seen()[patch, way]
    who = look.gap[:, patch, way].argmax(axis=0)
    lens = np.where(np.isnan(lens), look.T_base_sensor[who, :3, 3], lens)
    gap = np.maximum(predicted, simulated) + subject.radius
    middle = look.at.point[patch] + gap[:, None] * look.at.direction[patch, way]
    footprint = subject.cones.pitch[who] * np.linalg.norm(middle - lens, axis=1)
    return Throws(patch, way, predicted, simulated, footprint)


def _before(subject: Subject) -> tuple[Sight, World]:
    """The sensors of an ideal world in which there is nothing but a sphere."""
    world = World([])
    world.add(NAME, {"kind": "sphere", "radius_m": subject.radius}, (0.0, 0.0, 100.0))
    return Sight(eyes_of(draw_truth(subject.robot, subject.skin, IDEAL, 0)), world), world


def _first(sight: Sight, posture: Posture, reach: Array) -> int:
    """A sensor that sees the world within its reach, -1 if none does."""
    readings = sight.read(range(len(reach)), posture.T_base_link)
    for k, r in enumerate(readings):
        if ((r.label == WORLD) & (r.depth < reach[k])).any():
            return k
    return -1


def _at(point: Array) -> Array:
    T = np.eye(4)
    T[:3, 3] = point
    return T
