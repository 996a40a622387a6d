"""Placing sensors: the worth of every ring that may go on an arm, and the best of them.

Rings are chosen at every second of the postures; at the others, which had no part in the choice,
the layout is looked at as it will be worn, covers and all, beside the robot's own.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.choices import build_robot, build_robot_and_skin
from app.coverage.choosing import Choice, Problem, choose
from app.coverage.cones import cones_of, packed, poses_of
from app.coverage.first_seen import first_seen
from app.coverage.look import FAR, Subject, look, subject_of
from app.coverage.occlusion import blocked, views_of
from app.coverage.patches import patches_of, posed
from app.coverage.sites import COUNTS, TILTS, KeepOut, Place, clashes, places, rings_at
from app.coverage.worth import HORIZON, STEPS, value, weights, worths
from app.errors import ConfigError
from app.messages import Array
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.sensor_type import SensorType, load_sensor_type
from app.robot.skin import build_skin
from app.robot.skin_file import RingTable, ring_sensors
from app.setup import Setup
from app.studies.pool import each, one_thread

PATCHES = 600
SLICE = 24  # rings looked at together: their gaps fill some tens of megabytes


@dataclass(frozen=True)
class Wanted:
    """What is to be placed on the robot of a setup.

    sensors: how many at most.   kind: their type.   links: empty: every round one.
    ports, baud: serial ports and their speed, which must carry them all.
    horizon: [m] the gap at which it is soon enough to see something.
    """

    setup: Setup
    sensors: int
    kind: str = "vl53l8cx"
    links: tuple[str, ...] = ()
    keep_out: tuple[KeepOut, ...] = ()
    counts: tuple[int, ...] = COUNTS
    tilts: tuple[float, ...] = TILTS
    patches: int = PATCHES
    radius: float = 0.05
    ports: int = 1
    baud: int = 2_000_000
    horizon: float = HORIZON


class Candidates(NamedTuple):
    """The bare arm, and every ring that may go on it with its place."""

    robot: Robot
    type: SensorType
    rings: tuple[RingTable, ...]
    at: tuple[Place, ...]


class Placed(NamedTuple):
    """What was chosen: rings in order along the links, and how good the choice is."""

    rings: tuple[RingTable, ...]
    choice: Choice
    whole: float

    @property
    def of_best(self) -> float:
        """It is worth at least this share of the best there can be, before covers."""
        return self.choice.value / self.choice.bound


@lru_cache(maxsize=1)
def candidates_for(wanted: Wanted) -> Candidates:
    """ConfigError where the ports cannot carry the sensors; RobotError where nothing fits."""
    kind, least = load_sensor_type(wanted.kind), min(wanted.counts)
    if wanted.sensors < least:
        raise ConfigError(f"{wanted.sensors} sensors are less than a ring; give {least} or more")
    _check_bus(wanted, kind)
    robot = build_robot(replace(wanted.setup, skin="none"))
    rings, at = [], []
    for place in places(robot, wanted.links, wanted.keep_out):
        found = [
            r for r in rings_at(place, wanted.counts, wanted.tilts) if r.count <= wanted.sensors
        ]
        rings += found
        at += [place] * len(found)
    return Candidates(robot, kind, tuple(rings), tuple(at))


def _check_bus(wanted: Wanted, kind: SensorType) -> None:
    """A frame is 3 bytes a zone and 20 around them; a byte takes 10 bits on the line."""
    need = wanted.sensors * (3 * kind.zones + 20) / kind.period
    have = wanted.ports * wanted.baud / 10.0
    if need > have:
        raise ConfigError(
            f"{wanted.sensors} sensors send {need / 1e3:.0f} kB/s, {wanted.ports} ports at "
            f"{wanted.baud} baud carry {have / 1e3:.0f}; give more --ports, a higher --baud or "
            "fewer --sensors"
        )


class Task(NamedTuple):
    """One posture of a placement: its number and the joints (n,)."""

    wanted: Wanted
    number: int
    q: Array


class Part(NamedTuple):
    """Of one posture: worths (R, P * M) of the rings, and the weights (P * M,) of the ways."""

    number: int
    worth: NDArray[np.uint8]
    weight: NDArray[np.float32]


def part_of(task: Task) -> Part:
    """What every candidate sees at a posture."""
    wanted, c = task.wanted, candidates_for(task.wanted)
    posture = c.robot.posture(np.array(task.q))
    T_base_link = np.array(posture.T_base_link)
    patches = patches_of(c.robot, wanted.patches)
    at = posed(patches, T_base_link)
    barred = blocked(c.robot, at, T_base_link, FAR)
    worth = np.empty((len(c.rings), barred.size), dtype=np.uint8)
    for first in range(0, len(c.rings), SLICE):
        rings = c.rings[first : first + SLICE]
        sensors = [s for r in rings for s in ring_sensors(r, c.type, r.name)]
        skin = build_skin("candidates", tuple(sensors), c.robot)
        cones = cones_of(skin)
        views = views_of(c.robot, skin, cones, T_base_link)
        gap = first_seen(
            at.point, at.direction, barred, poses_of(cones, T_base_link),
            packed(cones, views.free), wanted.radius, FAR,
        )  # fmt: skip
        starts = np.cumsum([0, *(r.count for r in rings[:-1])])
        best = np.maximum.reduceat(gap, starts, axis=0).reshape(len(rings), -1)
        worth[first : first + len(rings)] = worths(best, wanted.horizon)
    subject = Subject(c.robot, skin, patches, cones, wanted.radius)
    weight = weights(subject, posture, at, barred).astype(np.float32).ravel()
    return Part(task.number, worth, weight)


def problem_of(
    wanted: Wanted, q: Array, jobs: int = 1, told: Callable[[], None] = lambda: None
) -> Problem:
    """What there is to choose from, at postures q (m, n); `told` of every posture looked at."""
    c = candidates_for(wanted)
    tasks = [Task(wanted, i, posture) for i, posture in enumerate(q)]
    parts: dict[int, Part] = {}
    with one_thread():
        for part in each(part_of, tasks, min(jobs, len(tasks))):
            parts[part.number] = part
            told()
    ordered = [parts[i] for i in range(len(tasks))]
    return Problem(
        np.hstack([p.worth for p in ordered]),
        np.concatenate([p.weight for p in ordered]),
        np.array([r.count for r in c.rings], dtype=np.int64),
        clashes(c.at),
    )


def place(wanted: Wanted, problem: Problem, sensors: int) -> Placed:
    """The best rings found of so many sensors at most."""
    c, choice = candidates_for(wanted), choose(problem, sensors)
    rings = sorted(choice.taken, key=lambda r: (c.at[r].link, c.at[r].along))
    return Placed(tuple(c.rings[r] for r in rings), choice, STEPS * float(problem.weight.sum()))


def worn(setup: Setup, q: Array, wanted: Wanted) -> tuple[float, int]:
    """What a layout is worth as it is worn, covers and all, 0 to 1: the mean over q (m, n); and how
    many sensors it has."""
    robot, skin = build_robot_and_skin(setup)
    subject = subject_of(robot, skin, wanted.patches, None, wanted.radius)
    found = [_worn_at(subject, robot.posture(p), wanted.horizon) for p in q]
    return float(np.mean(found)), skin.count


def _worn_at(subject: Subject, posture: Posture, horizon: float) -> float:
    seen = look(subject, posture)
    return value(seen, weights(subject, posture, seen.at, seen.barred), horizon)
