"""X6, widened: sensors that fail while the arm works. Does it run into anything, what does it cost?

Half a second after the start some sensors fail, in one of the ways of `app.studies.faulty_skin`,
or a hand lies on a window from the start. Before the plate it is those that look most towards the
goal, in the cell any, the same ones and more of them for each number. The target is that the arm
moves into nothing, and that with one sensor less a laboratory's day goes on: most of the work is
done that is done with all of them. The work is the way along the program, and before the plate,
behind which the goal lies, how near the tool has come to it.
"""

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, Mode, Snapshot
from app.report import Check
from app.robot.skin import Skin
from app.runtime import Engine
from app.studies.case import FAILS_AT, Case, setup_of
from app.studies.conditions import HAND, Condition, read_condition
from app.studies.experiment import Experiment, Told, register
from app.studies.faulty_skin import KINDS
from app.studies.trial import TrialResult, TrialSpec

PANEL, CELL, PROGRAM = "front-panel", "cell", "door-screws"
COUNTS = (1, 3, 9, 14, 29)  # of the sensors that fail
WORK = 0.8  # share of the work that is done with one sensor less
FAULT = re.compile(r"\+(" + "|".join((*KINDS, HAND)) + r"):(\d+)")
DEFAULT = ("QP", f"QP+{HAND}:1", *(f"QP+{kind}:{k}" for kind in KINDS for k in COUNTS))


def case(spec: TrialSpec, c: Condition) -> Case:
    """The plate, or the cell with its program."""
    setup = setup_of(spec, c, c.variant, program=PROGRAM if c.variant == CELL else "")
    return Case(
        setup, c.params(), lambda engine: FaultWatch(engine, c),
        first=towards_goal if c.variant == PANEL else None,
    )  # fmt: skip


def towards_goal(s: Snapshot, skin: Skin) -> NDArray[np.intp]:
    """The sensors, those first that look most towards the goal."""
    T = s.T_base_link[skin.link]
    axis = np.einsum("kij,kj->ki", T[:, :3, :3], skin.axis)
    return np.argsort(-(axis @ (s.goal.T_base_tool[:3, 3] - s.T_base_tool[:3, 3])))


class FaultWatch:
    """What was done, and what people were told meanwhile."""

    def __init__(self, engine: Engine, c: Condition) -> None:
        self._cell, self._from = c.variant == CELL, 0.0 if c.fault == HAND else FAILS_AT
        self._way = 0.0
        self._begin = self._nearest = np.nan  # [m] from the goal, at first and at best
        self._speed: list[float] = []
        self._goal: Array | None = None
        self._words: Counter[str] = Counter()
        self._last: Snapshot | None = None

    def update(self, s: Snapshot) -> None:
        """Take note of one tick."""
        at, toward = s.T_base_tool[:3, 3], s.goal.T_base_tool[:3, 3]
        if self._goal is not None and s.status.mode is not Mode.IDLE:
            self._way += float(np.linalg.norm(toward - self._goal))  # along the program
        self._goal, self._last = toward, s
        far = float(np.linalg.norm(toward - at))
        self._begin = far if np.isnan(self._begin) else self._begin
        self._nearest = float(np.fmin(self._nearest, far))
        if s.stamp >= self._from:
            self._speed.append(float(np.abs(s.joints.qd).max()))
            self._words[s.advice or s.status.reason] += 1

    def figures(self) -> dict[str, Any]:
        """way_m: the work.   speed_rad_s: mean of the fastest joint's, since the failure."""
        s = self._last
        assert s is not None
        return {
            "way_m": self._way if self._cell else self._begin - self._nearest,
            "speed_rad_s": float(np.mean(self._speed)) if self._speed else np.nan,
            "blind": s.blind,
            "status": f"{s.status.mode.value}: {s.status.reason}",
            "advice": self._words.most_common(1)[0][0] if self._words else "",
        }

    def marks(self) -> list[list[Any]]:
        """Nothing but the course."""
        return []


def whole(condition: str) -> str:
    """The condition without its fault, with which its work is compared."""
    return FAULT.sub("", condition)


def told(good: Sequence[TrialResult]) -> Told:
    """A row for each trial, and what it did of the work of the same without a fault."""
    work = {(t.condition, t.seed): t.figures["way_m"] for t in good if whole(t.mode) == t.mode}
    rows = [row(t, work.get((whole(t.condition), t.seed), np.nan)) for t in good]
    return Told(rows, checks(rows))


def row(t: TrialResult, whole_m: float) -> dict[str, Any]:
    """One trial; whole_m: [m] the work without a fault."""
    c, f = read_condition(t.condition, False, (PANEL, CELL)), t.figures
    return {
        "name": t.condition, "scene": c.variant, "kind": c.fault or "none", "sensors": c.failing,
        "seed": t.seed, "own_contacts": f["own_contacts"], "contacts": f["contacts"],
        "own_mps": f["own_mps"], "least_m": f["true_least_m"], "speed_rad_s": f["speed_rad_s"],
        "way_m": f["way_m"], "work": f["way_m"] / max(whole_m, 1e-9), "blind": f["blind"],
        "status": f["status"], "advice": f["advice"],
    }  # fmt: skip


def checks(rows: Sequence[dict[str, Any]]) -> list[Check]:
    """No contact is the arm's own; one sensor less leaves most of the work."""
    own = Check("contacts that the arm moved into", sum(r["own_contacts"] for r in rows), "", 0.0)
    return [own] + [
        Check(f"{r['name']}: work beside no fault", r["work"], "", WORK, at_least=True)
        for r in rows
        if r["sensors"] == 1 and r["kind"] in KINDS
    ]


def before(conditions: Sequence[str]) -> list[str]:
    """The same controllers without a fault, once."""
    return list(dict.fromkeys(whole(c) for c in conditions))


register(
    Experiment(
        "faults", "Sensors that fail while the arm works, in every way and number.",
        DEFAULT, 1, 10.0, case, told, before=before, variants=(PANEL, CELL),
        looked_at=("true_least_m", "way_m"),
    )
)  # fmt: skip
