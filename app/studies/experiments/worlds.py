"""Random worlds: does any controller ever exceed a limit, and why does it touch something?

A world has one to four bodies around the arm, half of them moving, and a goal that jumps. The
same seed gives the same world to each controller. Why a touch was not avoided is asked by two
rules (`app.judge.blame`), in the same way of every controller. Beside them stands the oracle,
our controller that perceives the truth (`app.studies.oracle`): what it touches as well is
nobody's fault. The rest is ours: perception's, where the touched link's distance was not known
half a second ahead, or where a phantom was fled from; control's otherwise.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from app.config import Params
from app.control.registry import taking_part
from app.judge.blame import TRUE, Cause
from app.judge.contact import INTO
from app.report import Check
from app.studies.conditions import ORACLE, short
from app.studies.experiment import Experiment, Told, register
from app.studies.rows import grouped
from app.studies.trial import TrialResult
from app.studies.world_trial import condition, run_world

OURS = short(Params().mode)  # the controller that is blamed for what it touches
FEW = 20  # avoidable touches of 1 000 worlds
ROUNDING = 1e-9


def told(good: Sequence[TrialResult]) -> Told:
    """A row for each condition, whose fault touches are, each touch and stop; and the checks."""
    rows = [row(name, trials) for name, trials in grouped(good).items()]
    rows += [split(OURS, good), *moments(good)]
    return Told(rows, checks(good))


def row(name: str, trials: Sequence[TrialResult]) -> dict[str, Any]:
    """One controller's touches by cause, under both rules."""
    figures = [t.figures for t in trials]
    least = np.array([f["least"] for f in figures if np.isfinite(f["least"])] or [np.nan])
    touches = [f["touch"] for f in figures if f["touch"]]
    return {
        "name": name,
        "worlds": len(trials),
        "touches": len(touches),
        "first_moment": _counted(touches, "cause"),
        "every_moment": _counted(touches, "cause_every"),
        "moved_into": sum(t["own_mps"] > INTO for t in touches),
        "median_least_m": float(np.median(least)),
        "p10_least_m": float(np.percentile(least, 10)),
    }


def _counted(touches: Sequence[dict[str, Any]], key: str) -> dict[str, int]:
    counts = Counter(t[key] for t in touches)
    return {cause.value: counts[cause] for cause in Cause}


def split(mode: str, trials: Sequence[TrialResult]) -> dict[str, Any]:
    """Whose fault a controller's touches are, seen beside the oracle's in the same worlds."""
    touches = {(t.condition, t.seed): t.figures["touch"] for t in trials}
    spared = {seed for (name, seed), touch in touches.items() if name == ORACLE and not touch}
    touched = {seed: touch for (name, seed), touch in touches.items() if name == mode and touch}
    ours = [touch for seed, touch in touched.items() if seed in spared]
    unseen = sum(touch["cause"] == Cause.NOT_SEEN for touch in ours)
    fled = sum(touch["cause"] != Cause.NOT_SEEN and touch["phantom_m"] > TRUE for touch in ours)
    return {
        "name": f"{mode} beside the {ORACLE}",
        "nobody": len(touched) - len(ours),
        "perception_unseen": unseen,
        "perception_phantom": fled,
        "control": len(ours) - unseen - fled,
    }


def moments(trials: Sequence[TrialResult]) -> list[dict[str, Any]]:
    """A row for each touch and each stop."""
    touches = [(t, t.figures["touch"]) for t in trials if t.figures["touch"]]
    rows = [{"name": f"touch {t.condition} seed {t.seed}", **touch} for t, touch in touches]
    stops = [(t, t.figures["stop"]) for t in trials if t.figures["stop"]]
    return rows + [{"name": f"stop {t.condition} seed {t.seed}", "why": why} for t, why in stops]


def checks(trials: Sequence[TrialResult]) -> list[Check]:
    """No limit is ever exceeded, and our controller touches little that it could have avoided."""
    worlds = len({t.seed for t in trials})
    touches = [t.figures["touch"] for t in trials if t.condition == OURS and t.figures["touch"]]
    blamed = sum(1 for touch in touches if touch["cause"] == Cause.AVOIDABLE)
    speed, change, reach = (
        max((t.figures[key] for t in trials), default=-np.inf)
        for key in ("speed", "change", "reach")
    )
    wild = sum(not t.figures["finite"] for t in trials)
    return [
        Check("worlds", float(worlds), "", 1000.0, at_least=True),
        Check("excess over a velocity limit", speed, "rad/s", ROUNDING),
        Check("excess over an acceleration limit", change, "rad/s^2", ROUNDING),
        Check("excess over a position limit", reach, "rad", ROUNDING),
        Check("commands not finite", float(wild), "", 0.0),
        Check("stops", float(sum(bool(t.figures["stop"]) for t in trials)), "", 0.0),
        Check(f"{OURS}: avoidable by the first moment", float(blamed), "", FEW * worlds / 1000.0),
    ]


register(
    Experiment(
        "worlds", "Every controller and the oracle in the same random worlds.",
        (*(short(kind.name) for kind in taking_part("worlds")), ORACLE), 30, 10.0, None, told,
        run=run_world, check=condition,
    )
)  # fmt: skip
