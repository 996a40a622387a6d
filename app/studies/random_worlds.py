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
from pathlib import Path
from typing import Any

import numpy as np

from app.config import Params
from app.control.registry import taking_part
from app.judge.blame import TRUE, Cause
from app.judge.contact import INTO
from app.report import Check, Report
from app.studies.pool import each, shard_of
from app.studies.trial_log import Trial, TrialLog
from app.studies.world_trial import ORACLE, TrialSpec, run_spec

OURS = Params().mode  # the controller that is blamed for what it touches
FEW = 20  # avoidable touches of 1 000 worlds
ROUNDING = 1e-9
WARM = 0.3  # [s] of a trial that only compiles


def random_worlds(
    worlds: int,
    seconds: float = 10.0,
    seed: int = 0,
    *,
    log: Path | None = None,
    jobs: int = 1,
    shard: str = "1/1",
    world: str = "honest",
    rate: float = 125.0,
) -> Report:
    """`worlds` worlds for `seconds` each, under every controller and the oracle.

    log:   a file of trials; those in it are not run again, and each new one is added to it.
    shard: 'I/N': only every N-th world from the I-th on.
    world: error budget of the simulation.
    """
    done = TrialLog(log, {"seconds": seconds, "rate": rate, "world": world}, Trial)
    modes = [*(kind.name for kind in taking_part("worlds")), ORACLE]
    seeds = shard_of(range(seed, seed + worlds), shard)
    wanted = [(i, mode) for i in seeds for mode in modes]
    missing = [TrialSpec(*key, seconds, rate, world) for key in done.missing(wanted)]
    if jobs > 1 and missing:
        for mode in modes:  # every kernel is compiled once, before there are several processes
            run_spec(TrialSpec(seed, mode, WARM, rate, world))
    for trial in each(run_spec, missing, jobs):
        done.add(trial)
    trials = [done.done[key] for key in wanted]
    rows = [row(mode, [t for t in trials if t.mode == mode]) for mode in modes]
    rows += [split(OURS, trials), *told(trials)]
    return Report("random worlds", seed, rows, checks(trials, len(seeds)))


def row(mode: str, trials: Sequence[Trial]) -> dict[str, Any]:
    """One controller's touches by cause, under both rules."""
    least = np.array([t.least for t in trials if np.isfinite(t.least)] or [np.nan])
    touches = [t.touch for t in trials if t.touch]
    return {
        "name": mode,
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


def split(mode: str, trials: Sequence[Trial]) -> dict[str, Any]:
    """Whose fault a controller's touches are, seen beside the oracle's in the same worlds."""
    spared = {t.seed for t in trials if t.mode == ORACLE and not t.touch}
    touched = {t.seed: t.touch for t in trials if t.mode == mode and t.touch}
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


def told(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """A row for each touch and each fault."""
    rows = [{"name": f"touch {t.mode} seed {t.seed}", **t.touch} for t in trials if t.touch]
    return rows + [
        {"name": f"fault {t.mode} seed {t.seed}", "fault": t.fault} for t in trials if t.fault
    ]


def checks(trials: Sequence[Trial], worlds: int) -> list[Check]:
    """No limit is ever exceeded, and our controller touches little that it could have avoided."""
    blamed = sum(
        1 for t in trials if t.mode == OURS and t.touch and t.touch["cause"] == Cause.AVOIDABLE
    )
    speed, change, reach = (
        max(getattr(t, key) for t in trials) for key in ("speed", "change", "reach")
    )
    return [
        Check("worlds", float(worlds), "", 1000.0, at_least=True),
        Check("excess over a velocity limit", speed, "rad/s", ROUNDING),
        Check("excess over an acceleration limit", change, "rad/s^2", ROUNDING),
        Check("excess over a position limit", reach, "rad", ROUNDING),
        Check("commands not finite", float(sum(not t.finite for t in trials)), "", 0.0),
        Check("exceptions", float(sum(bool(t.fault) for t in trials)), "", 0.0),
        Check(f"{OURS}: avoidable by the first moment", float(blamed), "", FEW * worlds / 1000.0),
    ]
