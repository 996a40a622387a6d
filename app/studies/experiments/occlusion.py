"""X5: a thing appears where no sensor looks, is seen on the way, and is hidden when it matters.

What is not remembered then is run into by the wrist, which has no sensor that looks ahead.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from app.judge.metrics import KNOWN
from app.messages import Snapshot
from app.report import Check
from app.runtime import Engine
from app.studies.case import Case, setup_of
from app.studies.comparisons import comparison_rows
from app.studies.conditions import Condition
from app.studies.experiment import Experiment, Told, register
from app.studies.rows import grouped, row_of
from app.studies.settled import settled
from app.studies.trial import TrialResult, TrialSpec

NAME, BALL = "occlusion", "ball"  # the first of the scene and of its program
CONDITIONS = ("QP", "QP-memory", "WB", "WB+set:memory=true", "oracle")
FIRST = ("least_m",)
COMPARED = ("least_m", "goal_error_m")


class Sight:
    """When the ball was seen, and when it was remembered: points of the cloud and of the memory
    within `KNOWN` of its middle and radius."""

    def __init__(self, engine: Engine) -> None:
        self._seen: list[bool] = []
        self._known: list[bool] = []
        self._marks: list[list[Any]] = []

    def update(self, s: Snapshot) -> None:
        """Take note of one tick, and of each time that it comes into sight or leaves it."""
        ball = next(b for b in s.world if b.view.name == BALL)
        centre = ball.T_base_body[:3, 3]
        within = float(np.abs(ball.view.vertices).max()) + KNOWN
        seen, known = (
            bool(len(points) and (np.linalg.norm(points - centre, axis=1) < within).any())
            for points in (s.cloud.kept(), s.memory)
        )
        if seen != (self._seen[-1] if self._seen else False):
            self._marks.append([s.stamp, f"the {BALL} {'is seen' if seen else 'is not seen'}"])
        self._seen.append(seen)
        self._known.append(known)

    def figures(self) -> dict[str, Any]:
        """Shares of the time in which it was in sight, and in which it was remembered."""
        return {
            "in_sight": float(np.mean(self._seen)), "remembered": float(np.mean(self._known)),
        }  # fmt: skip

    def marks(self) -> list[list[Any]]:
        """[stamp, words] of what came into sight and left it."""
        return self._marks


def case(spec: TrialSpec, c: Condition) -> Case:
    """The scene and its program."""
    return Case(
        setup_of(spec, c, NAME, program=NAME), c.params(), None if c.oracle else Sight,
        more=lambda notes: settled(notes) | {"least_m": float(min(notes.true))},
    )  # fmt: skip


def told(good: Sequence[TrialResult]) -> Told:
    """A row for each condition, what memory is worth, and that our controller runs into nothing."""
    rows = [row_of(name, trials, FIRST) for name, trials in grouped(good).items()]
    checks = [
        Check(f"{r['name']}: moved into", r["own_contacts"], "", 0.0)
        for r in rows
        if r["name"] == "QP"
    ]
    return Told([*rows, *comparison_rows(good, COMPARED)], checks)


register(
    Experiment(
        NAME, "A thing that is seen for a while, and run into by whoever forgets it.",
        CONDITIONS, 10, 20.0, case, told, looked_at=COMPARED,
    )
)  # fmt: skip
