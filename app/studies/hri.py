"""The paper's experiment beside a person: two sides of the cell, and several controllers.

A condition is a controller and a side: SR, SL, WBR and WBL are the paper's. The same seed gives
every condition the same sensors and the same habits of the person, so that conditions are
compared seed by seed; each controller's work is compared with what it does alone in the cell.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from app.config import Params
from app.control.registry import kind_of
from app.errors import ConfigError, options
from app.judge.encounter import Encounter
from app.report import Check, Report
from app.setup import Setup
from app.studies.bootstrap import bootstrap
from app.studies.headless import step_until
from app.studies.pool import each, shard_of
from app.studies.trial_log import TrialLog
from app.timing import ManualClock
from app.wiring import build_engine

MODES = {"S": "sm", "WB": "wb", "QP": "qp", "paper": "paper"}
SIDES = {"R": "right", "L": "left"}
ALONE = "alone"
PAPER = {"SR": (0.281, 0.135), "SL": (0.169, 0.100), "WBR": (0.279, 0.097), "WBL": (0.295, 0.214)}
DEFAULT = ("SR", "SL", "WBR", "WBL", "QPR", "QPL")
PROGRAM = "car-door"
FARTHER = 0.05  # [m] WBL - SL, at least
AS_FAR = 0.10  # share of SR by which WBR may differ
SUMMED = ("contacts", "stops")
WORST = ("true_least_m", "cell_least_m")
LEFT_OUT = ("nearest_link", "reactions")


class HriSpec(NamedTuple):
    """One trial. condition: as in `MODES` and `SIDES`, or a controller and `ALONE`."""

    condition: str
    seed: int
    seconds: float = 60.0
    rate: float = 125.0
    world: str = "honest"


@dataclass
class HriTrial:
    """What came of a trial: figures of `app.judge.encounter`, or the cause of its death.

    mode: the condition.
    """

    seed: int
    mode: str
    figures: dict[str, Any] = field(default_factory=dict)
    fault: str = ""


def condition_of(name: str) -> tuple[str, str]:
    """Controller and side of a condition; ConfigError for one that there is not."""
    known = {m + s: (MODES[m], SIDES[s]) for m in MODES for s in SIDES}
    known |= {f"{m} {ALONE}": (MODES[m], "") for m in MODES}
    if name not in known:
        raise ConfigError(f"no condition {name!r}; {options(name, known)}")
    return known[name]


def run_hri(spec: HriSpec) -> HriTrial:
    """The trial of a specification; one that dies is a trial with its cause."""
    try:
        return HriTrial(spec.seed, spec.condition, _run(spec))
    except Exception as error:
        return HriTrial(spec.seed, spec.condition, fault=f"the trial died: {error!r}")


def _run(spec: HriSpec) -> dict[str, Any]:
    """Each controller as it is meant to be run: the paper's have no memory."""
    mode, side = condition_of(spec.condition)
    setup = Setup(
        scene=f"cell-{side or 'left'}", person="" if side else "none", program=PROGRAM,
        seed=spec.seed, rate=spec.rate, world=spec.world,
    )  # fmt: skip
    params = Params(mode=mode, memory=kind_of(mode).memory[0])
    engine = build_engine(setup, ManualClock(), params)
    watch = Encounter(engine)
    step_until(engine, spec.seconds, watch.update)
    return watch.figures(params.distance_kept, spec.rate)


@dataclass(frozen=True)
class HriStudy:
    """What is tried. log: a file of trials; those in it are not run again.

    shard: 'I/N': only every N-th trial from the I-th on.
    """

    conditions: tuple[str, ...] = DEFAULT
    trials: int = 10
    seconds: float = 60.0
    seed: int = 0
    world: str = "honest"
    rate: float = 125.0
    jobs: int = 1
    shard: str = "1/1"
    log: Path | None = None

    def wanted(self) -> list[tuple[int, str]]:
        """Seed and condition of every trial, each controller alone once."""
        for name in self.conditions:
            condition_of(name)
        alone = dict.fromkeys(f"{c[:-1]} {ALONE}" for c in self.conditions if c[-1] in SIDES)
        seeds = range(self.seed, self.seed + self.trials)
        every = [(s, c) for s in seeds for c in self.conditions]
        return list(shard_of([(self.seed, c) for c in alone] + every, self.shard))


def hri(study: HriStudy) -> Report:
    """Run what is missing and tell of all."""
    settings: dict[str, float | str] = {
        "seconds": study.seconds, "rate": study.rate, "world": study.world,
    }  # fmt: skip
    log, wanted = TrialLog(study.log, settings, HriTrial), study.wanted()
    tail = (study.seconds, study.rate, study.world)
    missing = [HriSpec(condition, seed, *tail) for seed, condition in log.missing(wanted)]
    if study.jobs > 1 and missing:
        run_hri(missing[0]._replace(seconds=0.3))  # kernels are compiled before there are several
    for trial in each(run_hri, missing, study.jobs):
        log.add(trial)
    return told([log.done[key] for key in wanted], study.seed)


def told(trials: Sequence[HriTrial], seed: int) -> Report:
    """A row for each condition, beside the paper's, the paper's comparisons, and faults."""
    good = [t for t in trials if not t.fault]
    names = list(dict.fromkeys(t.mode for t in good))
    alone = {
        t.mode.removesuffix(f" {ALONE}"): t.figures["waypoints_per_min"]
        for t in good if t.mode.endswith(ALONE)
    }  # fmt: skip
    of = {n: sorted((t for t in good if t.mode == n), key=lambda t: t.seed) for n in names}
    rows = [row(n, of[n], alone.get(n[:-1])) for n in names]
    checks = []
    for key in ("paper_mean_m", "true_mean_m"):
        if {"WBL", "SL"} <= set(names):
            d = difference(of["WBL"], of["SL"], key)
            rows.append({"name": f"WBL - SL, {key}", **d})
            checks.append(Check(f"WBL - SL, {key}", d["mean"], "m", FARTHER, at_least=True))
            checks.append(Check(f"WBL - SL, {key}, low", d["low"], "m", 0.0, at_least=True))
        if {"WBR", "SR"} <= set(names):
            d = difference(of["WBR"], of["SR"], key)
            rows.append({"name": f"WBR - SR, {key}", **d})
            share = abs(d["mean"]) / float(np.mean([t.figures[key] for t in of["SR"]]))
            checks.append(Check(f"|WBR - SR| / SR, {key}", share, "", AS_FAR))
    checks.append(Check("trials that died", float(len(trials) - len(good)), "", 0.0))
    rows += [{"name": f"fault {t.mode} seed {t.seed}", "why": t.fault} for t in trials if t.fault]
    return Report("hri", seed, rows, checks)


def row(name: str, trials: Sequence[HriTrial], alone: float | None) -> dict[str, Any]:
    """One condition: the paper's two figures beside the paper's, then all others."""
    figures = [t.figures for t in trials]
    mean, low, high = bootstrap([f["paper_mean_m"] for f in figures])
    out: dict[str, Any] = {
        "name": name, "trials": len(trials), "dbar_m": mean, "low_m": low, "high_m": high,
        "sigma_max_m": max(f["paper_std_m"] for f in figures),
    }  # fmt: skip
    if name in PAPER:
        out["paper_dbar_m"], out["paper_sigma_max_m"] = PAPER[name]
    true = bootstrap([f["true_mean_m"] for f in figures])
    out["true_dbar_m"], out["true_low_m"], out["true_high_m"] = true
    out["true_sigma_max_m"] = max(f["true_std_m"] for f in figures)
    for key in figures[0]:
        if key in LEFT_OUT or key.endswith(("_mean_m", "_std_m")):
            continue
        values = np.array([f[key] for f in figures], dtype=np.float64)
        known = values[np.isfinite(values)]
        if key in SUMMED:
            out[key] = int(values.sum())
        elif len(known):
            out[key] = float(known.min() if key in WORST else known.mean())
    if alone:
        out["work"] = out["waypoints_per_min"] / alone
    if any(figures[0]["nearest_link"]):
        out["nearest"] = _nearest(figures)
    # nothing is near who works alone
    return {k: v for k, v in out.items() if not isinstance(v, float) or np.isfinite(v)}


def difference(a: Sequence[HriTrial], b: Sequence[HriTrial], key: str) -> dict[str, float]:
    """Mean of a - b seed by seed, with its interval."""
    other = {t.seed: t.figures[key] for t in b}
    mean, low, high = bootstrap([t.figures[key] - other[t.seed] for t in a if t.seed in other])
    return {"mean": mean, "low": low, "high": high}


def _nearest(figures: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Share of the time in which each link was the nearest, of those with a tenth or more."""
    links = dict.fromkeys(name for f in figures for name in f["nearest_link"])
    share = {n: float(np.mean([f["nearest_link"].get(n, 0.0) for f in figures])) for n in links}
    return {n: round(s, 2) for n, s in share.items() if n and s >= 0.1}
