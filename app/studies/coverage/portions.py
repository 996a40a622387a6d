"""Postures in portions, each of which any process may take."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from app.choices import build_robot_and_skin
from app.coverage.look import Subject, look, subject_of
from app.coverage.tally import Sums, Tally
from app.coverage.volume import space
from app.messages import Array
from app.setup import Setup
from app.studies.pool import each, one_thread

SIZE = 10  # postures of a portion: the sums are the same however many processes there are


@dataclass(frozen=True)
class Plan:
    """What is looked at, for `app.coverage.look.subject_of`, and how fast things come [m/s]."""

    setup: Setup
    patches: int
    radius: float
    speed: float
    reach: float | None = None


class Portion(NamedTuple):
    """The how manieth portion of a plan's postures q (m, n)."""

    plan: Plan
    number: int
    q: Array


@lru_cache(maxsize=1)
def subject_for(plan: Plan) -> Subject:
    """The arm, its skin and its patches; a process makes them once."""
    robot, skin = build_robot_and_skin(plan.setup)
    return subject_of(robot, skin, plan.patches, plan.reach, plan.radius)


def tallied(plan: Plan, q: Array, jobs: int, told: Callable[[int], None]) -> Tally:
    """All postures q (m, n); `told` of every portion how many postures it had."""
    portions = [Portion(plan, i, q[i : i + SIZE]) for i in range(0, len(q), SIZE)]
    done: dict[int, Sums] = {}
    with one_thread():
        for number, sums in each(sums_of, portions, min(jobs, len(portions))):
            done[number] = sums
            told(min(SIZE, len(q) - number))
    tally = Tally(subject_for(plan), plan.speed)
    for number in sorted(done):
        tally.sums = tally.sums.plus(done[number])
    return tally


def sums_of(portion: Portion) -> tuple[int, Sums]:
    """The sums over a portion, with its number."""
    subject = subject_for(portion.plan)
    tally = Tally(subject, portion.plan.speed)
    for q in portion.q:
        seen = look(subject, subject.robot.posture(np.array(q)))
        tally.add(seen, space(subject, seen))
    return portion.number, tally.sums
