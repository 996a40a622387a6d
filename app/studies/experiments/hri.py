"""The paper's experiment beside a person: two sides of the cell, and several controllers.

A condition is a controller and a side: SR, SL, WBR and WBL are the paper's. The same seed gives
every condition the same sensors and the same habits of the person, so that conditions are
compared seed by seed; each controller's work is compared with what it does alone in the cell.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from app.report import Check
from app.studies.bootstrap import bootstrap
from app.studies.case import Case, setup_of
from app.studies.comparisons import comparison_rows
from app.studies.conditions import ALONE, Condition, words_of
from app.studies.experiment import Experiment, Told, register
from app.studies.moves import watch_moves
from app.studies.rows import grouped, row_of
from app.studies.trial import TrialResult, TrialSpec

PAPER = {"SR": (0.281, 0.135), "SL": (0.169, 0.100), "WBR": (0.279, 0.097), "WBL": (0.295, 0.214)}
DEFAULT = ("SR", "SL", "WBR", "WBL", "QPR", "QPL")
PROGRAM = "car-door"
FARTHER = 0.05  # [m] WBL - SL, at least
AS_FAR = 0.10  # share of SR by which WBR may differ
COMPARED = ("paper_mean_m", "true_mean_m", "true_least_m", "waypoints_per_min")


def case(spec: TrialSpec, c: Condition) -> Case:
    """The cell with the person on a side, or with nobody."""
    setup = setup_of(
        spec, c, f"cell-{c.side or 'left'}", person="none" if c.alone else "", program=PROGRAM
    )
    return Case(setup, c.params(), watch=watch_moves)


def alone(conditions: Sequence[str]) -> list[str]:
    """Each controller's work with nobody there, once."""
    return list(dict.fromkeys(_alone(c) for c in conditions if not c.endswith(ALONE)))


def _alone(condition: str) -> str:
    """The condition that its work is compared with."""
    return words_of(condition)[0][:-1] + ALONE


def told(good: Sequence[TrialResult]) -> Told:
    """A row for each condition, beside the paper's, and conditions compared seed by seed."""
    of = grouped(good)
    work = {t.mode: t.figures["waypoints_per_min"] for t in good if t.mode.endswith(ALONE)}
    rows = [row(n, of[n], work.get(_alone(n))) for n in of]
    found = {r["name"]: r for r in comparison_rows(good, COMPARED)}
    checks = []
    for key in COMPARED[:2]:
        if d := found.get(f"WBL - SL, {key}"):
            checks.append(Check(f"WBL - SL, {key}", d["mean"], "m", FARTHER, at_least=True))
            checks.append(Check(f"WBL - SL, {key}, low", d["low"], "m", 0.0, at_least=True))
        if d := found.get(f"WBR - SR, {key}"):
            share = abs(d["mean"]) / float(np.mean([t.figures[key] for t in of["SR"]]))
            checks.append(Check(f"|WBR - SR| / SR, {key}", share, "", AS_FAR))
    rows += found.values()
    return Told(rows, checks)


def row(name: str, trials: Sequence[TrialResult], alone: float | None) -> dict[str, Any]:
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
    out |= row_of(name, trials, left_out="_mean_m _std_m")
    if alone:
        out["work"] = out["waypoints_per_min"] / alone
    if any(figures[0]["nearest_link"]):
        out["nearest"] = _nearest(figures)
    # nothing is near who works alone
    return {k: v for k, v in out.items() if not isinstance(v, float) or np.isfinite(v)}


def _nearest(figures: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Share of the time in which each link was the nearest, of those with a tenth or more."""
    links = dict.fromkeys(name for f in figures for name in f["nearest_link"])
    share = {n: float(np.mean([f["nearest_link"].get(n, 0.0) for f in figures])) for n in links}
    return {n: round(s, 2) for n, s in share.items() if n and s >= 0.1}


register(
    Experiment(
        "hri", "The paper's trials beside a person, with the paper's figures next to ours.",
        DEFAULT, 10, 60.0, case, told, sides=True, before=alone,
        paper={n: {"paper_mean_m": d, "paper_std_m": s} for n, (d, s) in PAPER.items()},
        verdicts=("reproduced", "not reproduced"),
        looked_at=("paper_mean_m", "true_mean_m", "true_least_m", "below_kept", "work",
                   "path_error_m", "reaction_s"),
    )
)  # fmt: skip
