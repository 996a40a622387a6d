"""X4: a person walks at the arm, or past it, at four speeds; sensors measure 15 times a second.

The person neither stops for the arm nor gives way: what it touches standing still, by walking into
it, is no fault of the arm's. Who walks back and comes again has come twice. Links that one or two
joints move can hardly give way, so the least distance of the others is told apart.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from app.control.registry import kind_of
from app.judge import metrics
from app.judge.encounter import Notes
from app.messages import Snapshot
from app.report import Check
from app.runtime import Engine
from app.studies.case import Case, setup_of
from app.studies.comparisons import comparison_rows
from app.studies.conditions import Condition
from app.studies.distal import DistalLeast
from app.studies.experiment import Experiment, Told, register
from app.studies.moves import watch_moves
from app.studies.rows import grouped, row_of
from app.studies.trial import TrialResult, TrialSpec
from app.world.scene import find_scene, read_scene, scene_of

SPEEDS = ("0.3", "0.6", "1.0", "1.6")  # [m/s]
BY = "-by"
SCENES = {"": "approach", BY: "passing"}
CONTROLLERS = ("S", "WB", "QP", "oracle")
FIRST = ("distal_least_m", "least_m")
COMPARED = ("distal_least_m", "least_m", "entered_s")


class Beside(DistalLeast):
    """Also tells what the person does."""

    def __init__(self, engine: Engine) -> None:
        super().__init__(engine)
        self._moves = watch_moves(engine)

    def update(self, s: Snapshot) -> None:
        """Take note of one tick."""
        super().update(s)
        self._moves.update(s)

    def marks(self) -> list[list[Any]]:
        """[stamp, words] of the person's moves."""
        return self._moves.marks()


def case(spec: TrialSpec, c: Condition) -> Case:
    """A person who comes at the variant's speed, or goes by."""
    by = BY if c.variant.endswith(BY) else ""
    path = find_scene(SCENES[by])
    table = read_scene(path)
    (walker,) = table.person
    walker = replace(walker, speed_mps=float(c.variant.removesuffix(BY)))
    scene = scene_of(replace(table, person=(walker,)), path, spec.seed)
    params = c.params()
    distances = kind_of(c.mode).distances(params)
    begins = distances[1] if distances else params.avoidance_begins

    def more(notes: Notes) -> dict[str, Any]:
        """least_m: true distance.   entered_s: [s] from entering the distance at which avoidance
        begins to acting, of the first time; NaN if it acted before, or nobody entered."""
        stamp, true = np.array(notes.stamp), np.array(notes.true)
        times = metrics.reaction_times(stamp, true, np.array(notes.activation), begins)
        return {
            "least_m": float(true.min()), "begins_m": begins,
            "entered_s": times[0] if times else np.nan,
        }  # fmt: skip

    return Case(setup_of(spec, c, SCENES[by]), params, Beside, scene, more)


def told(good: Sequence[TrialResult]) -> Told:
    """A row for each condition, their differences, and that our controller moves into nobody."""
    rows = [row_of(name, trials, FIRST) for name, trials in grouped(good).items()]
    into = [r for r in rows if r["name"].startswith("QP@")]
    checks = [Check(f"{r['name']}: moved into", r["own_contacts"], "", 0.0) for r in into]
    return Told([*rows, *comparison_rows(good, COMPARED)], checks)


register(
    Experiment(
        "approach", "A person walks at the arm, or past it, at four speeds.",
        CONTROLLERS, 10, 12.0, case, told,
        variants=tuple(speed + by for by in SCENES for speed in SPEEDS),
        looked_at=COMPARED,
    )
)  # fmt: skip
