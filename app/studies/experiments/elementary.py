"""X7: the elementary situations of an arm and a ball, each short and alone.

The arm stands, or its goal goes to and fro on a straight line or round a circle. The ball stands on
its way, near it or off it, crosses it, or comes head-on, at three speeds: in the spirit of
C. Escobedo et al., "A Framework for the Systematic Evaluation of Obstacle Avoidance and
Object-Aware Controllers", 2022. All is on the left of the wrist, where the forearm's sensors look.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from app.actions import SetGoal
from app.messages import Array, Snapshot
from app.report import Check
from app.runtime import Engine
from app.studies.case import Case, setup_of
from app.studies.comparisons import compared
from app.studies.conditions import AT, Condition
from app.studies.distal import DistalLeast
from app.studies.experiment import Experiment, Told, register
from app.studies.paired import paired
from app.studies.rows import row_of
from app.studies.settled import settled
from app.studies.trial import TrialResult, TrialSpec
from app.world.scene import find_scene, read_scene, scene_of
from app.world.tables import BodyTable, LineMotion, SphereShape

SCENE, BALL, RADIUS = "empty", "ball", 0.10  # [m]
SIDE = (0.35, 0.23, 0.65)  # [m] of the wrist's left side at home
GAPS = {"on": 0.15, "near": 0.35, "off": 0.65}  # [m] of a ball that stands, to that side
CROSSES, MEETS = 0.15, 0.10  # [m] of one that crosses, and of the nearest of one that comes head-on
SPEEDS = ("0.2", "0.5", "1.0")  # [m/s]
ARM = {"static": 0.0, "line": 0.25, "circle": 0.15}  # [m] amplitude or radius of the goal's way
PACE = 0.20  # [m/s] of the goal at most
MOVING = ("crossing", "head-on")
BALLS = (*GAPS, *(f"{way}-{speed}" for way in MOVING for speed in SPEEDS))
CONTROLLERS = ("S", "WB", "QP", "oracle")
FIRST = ("distal_least_m",)
COMPARED = ("distal_least_m", "path_error_m", "jerk_rms")


def ball(name: str) -> BodyTable:
    """Where it is, and how it moves."""
    way, _, speed = name.rpartition("-")
    x, y, z = SIDE[0], SIDE[1] + RADIUS, SIDE[2]
    if name in GAPS:
        return BodyTable(BALL, SphereShape(RADIUS), (x, y + GAPS[name], z))
    if way == "crossing":
        here, there = (x - 1.2, y + CROSSES, z), (x + 1.2, y + CROSSES, z)
    else:
        here, there = (x, y + 1.3, z), (x, y + MEETS, z)
    motion = LineMotion(there, float(speed), dwell_s=0.5)
    return BodyTable(BALL, SphereShape(RADIUS), here, movable=False, motion=motion)


class Way(DistalLeast):
    """Leads the goal along its way, and watches what can give way."""

    def __init__(self, engine: Engine, arm: str) -> None:
        super().__init__(engine)
        self._engine, self._arm = engine, arm
        self._begin: Array | None = None

    def update(self, s: Snapshot) -> None:
        """The goal of the next tick."""
        super().update(s)
        if self._begin is None:
            self._begin = s.T_base_tool.copy()
        if self._arm != "static":
            T = self._begin.copy()
            T[:3, 3] += along(self._arm, s.stamp)
            self._engine.post(SetGoal(T))


def along(arm: str, t: float) -> Array:
    """(3,) [m] from where the goal began, at `t` [s]."""
    size = ARM[arm]
    if size == 0.0:
        return np.zeros(3)
    angle = PACE / size * t
    if arm == "line":
        return np.array([0.0, size * np.sin(angle), 0.0])
    return np.array([size * (np.cos(angle) - 1.0), size * np.sin(angle), 0.0])


def case(spec: TrialSpec, c: Condition) -> Case:
    """The arm and the ball of a variant."""
    arm, _, name = c.variant.partition("-")
    path = find_scene(SCENE)
    table = read_scene(path)
    scene = scene_of(replace(table, body=(*table.body, ball(name))), path, spec.seed)
    return Case(setup_of(spec, c, SCENE), c.params(), lambda e: Way(e, arm), scene, settled)


def told(good: Sequence[TrialResult]) -> Told:
    """A row for each controller over all situations, and their differences in the same ones."""
    of: dict[str, list[TrialResult]] = {}
    for t in good:
        of.setdefault(t.condition.partition(AT)[0], []).append(t)
    rows = [row(name, trials) for name, trials in of.items()]
    for a, b in compared(list(of)):
        for key in COMPARED:
            found = paired(_each(of[a], key), _each(of[b], key))
            rows.append({"name": f"{a} - {b}, {key}", **found._asdict()})
    into = [r for r in rows if r["name"] == "QP"]
    checks = [Check(f"{r['name']}: moved into", r["own_contacts"], "", 0.0) for r in into]
    return Told(rows, checks)


def row(name: str, trials: Sequence[TrialResult]) -> dict[str, Any]:
    """One controller; where it touched something, those situations are named."""
    touched = sorted({t.condition.partition(AT)[2] for t in trials if t.figures["contacts"]})
    return {
        **row_of(name, trials, FIRST), "touched": " ".join(touched),
        "situations": len({t.condition for t in trials}),
    }  # fmt: skip


def _each(trials: Sequence[TrialResult], key: str) -> dict[tuple[str, int], float]:
    """A figure of each situation and seed."""
    return {(t.condition.partition(AT)[2], t.seed): float(t.figures[key]) for t in trials}


register(
    Experiment(
        "elementary", "The elementary situations of an arm and a ball, each short and alone.",
        CONTROLLERS, 1, 8.0, case, told, variants=tuple(f"{a}-{b}" for a in ARM for b in BALLS),
        looked_at=COMPARED,
    )
)  # fmt: skip
