"""What the benchmark tells: a row for each controller in each set, and one over all sets."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from app.control.guests.files import is_guest
from app.judge.metrics import share_below
from app.studies.benchmark.listing import short_name
from app.studies.benchmark.run import Outcome
from app.studies.bootstrap import bootstrap
from app.studies.conditions import ORACLE
from app.studies.trial import TrialResult

ALL = "all sets"


class Column(NamedTuple):
    """key: of a row; an interval lies in key_low and key_high.   digits: behind the point."""

    key: str
    title: str
    digits: int
    about: str


COLUMNS = (
    Column("contacts", "contacts", 0, "how often the arm touches something, in all trials"),
    Column("own_contacts", "moved into", 0, "contacts towards which the arm itself moved"),
    Column("least_m", "least [m]", 3, "smallest true distance of all trials"),
    Column("short_mm", "shortfall [mm]", 1,
           "by how much the distance to keep is missed, mean of the time, then of trials, 95 %"),
    Column("gap_mm", "oracle gap [mm]", 1, "the same, less the oracle's in the same trials"),
    Column("below", "below", 3, "share of the time at 1 cm less than the distance to keep"),
    Column("work", "work", 2, "waypoints a minute, of those that it does with nobody there"),
    Column("path_m", "path error [m]", 3, "rms distance of the tool from where it should be"),
    Column("reaction_s", "reaction [s]", 2,
           "from a true 0.6 m until the arm itself leads its nearest link away 0.05 m/s faster"),
    Column("jumps", "jumps [1/s]", 2, "how often the control point is another one at once"),
    Column("jerk", "jerk [rad/s3]", 0, "rms of the commands' second difference"),
    Column("effort", "effort [rad2/s]", 2, "integral of the squared joint velocities"),
    Column("cut", "cut", 3,
           "share of ticks in which Flinch's limits left less than 99 % of a guest's command"),
    Column("stops", "stops", 0, "how often the arm was stopped"),
    Column("died", "died", 0, "trials without a result; why stands below"),
)  # fmt: skip
SAME = 0.01  # [m] so little below the distance to keep is none: a bound is met from above and below


def rows_of(outcomes: Sequence[Outcome], kept: float) -> list[dict[str, Any]]:
    """First a row over all sets for each controller, then one for each controller in each set.

    kept: [m] the distance to keep.
    """
    oracle = {o.set: o for o in outcomes if o.controller == ORACLE}
    rows = [_row(o, oracle.get(o.set), kept) for o in outcomes]
    controllers = list(dict.fromkeys(r["controller"] for r in rows))
    return [_over(c, [r for r in rows if r["controller"] == c]) for c in controllers] + rows


def faults_of(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """A row for each trial that died, with its cause."""
    return [
        {"controller": short_name(o.controller), "set": o.set, "seed": t.seed, "why": t.fault}
        for o in outcomes for t in o.trials.values() if t.fault
    ]  # fmt: skip


def _row(o: Outcome, oracle: Outcome | None, kept: float) -> dict[str, Any]:
    figures = [t.figures for t in o.good.values()]
    out: dict[str, Any] = {
        "set": o.set, "controller": short_name(o.controller), "trials": len(figures),
        "died": sum(bool(t.fault) for t in o.trials.values()),
    }  # fmt: skip
    if not figures:
        return out
    for key, name in (
        ("contacts", "contacts"),
        ("own_contacts", "own_contacts"),
        ("stops", "stops"),
    ):
        out[key] = sum(int(f[name]) for f in figures)
    out["least_m"] = min(f["true_least_m"] for f in figures)
    out |= _interval("short_mm", [1e3 * f["shortfall_m"] for f in figures])
    if oracle is not None and o.controller != ORACLE:
        truth = {k: t.figures["shortfall_m"] for k, t in oracle.good.items()}
        gaps = [t.figures["shortfall_m"] - truth[k] for k, t in o.good.items() if k in truth]
        out |= _interval("gap_mm", [1e3 * g for g in gaps])
    out["below"] = float(np.mean([_below(t, kept) for t in o.good.values()]))
    alone = [t for k, t in o.trials.items() if k.alone and not t.fault]
    if alone and alone[0].figures["waypoints_per_min"] > 0.0:
        done = [f["waypoints_per_min"] for f in figures]
        out["work"] = float(np.mean(done)) / alone[0].figures["waypoints_per_min"]
    means = {"path_m": "path_error_m", "reaction_s": "own_reaction_s", "jumps": "jumps_per_s",
             "jerk": "jerk_rms", "effort": "effort"}  # fmt: skip
    if is_guest(o.controller):
        means["cut"] = "held_back"
    for key, name in means.items():
        known = [f[name] for f in figures if np.isfinite(f[name])]
        if known:
            out[key] = float(np.mean(known))
    return out


def _below(t: TrialResult, kept: float) -> float:
    """Share of the time; distances were noted 15 times a second."""
    return share_below(np.array(t.course["true_m"]), kept - SAME)


def _interval(key: str, values: Sequence[float]) -> dict[str, float]:
    """Mean and 95 % interval; no interval of one value."""
    if not values:
        return {}
    if len(values) == 1:
        return {key: float(values[0])}
    mean, low, high = bootstrap(values)
    return {key: mean, f"{key}_low": low, f"{key}_high": high}


def _over(controller: str, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Sums, the worst, and means in which every set counts the same."""
    out: dict[str, Any] = {"set": ALL, "controller": controller}
    for key in ("trials", "died", "contacts", "own_contacts", "stops"):
        out[key] = sum(r.get(key, 0) for r in rows)
    for key in (
        "short_mm",
        "gap_mm",
        "below",
        "work",
        "path_m",
        "reaction_s",
        "jumps",
        "jerk",
        "effort",
        "cut",
    ):
        known = [r[key] for r in rows if key in r]
        if known:
            out[key] = float(np.mean(known))
    known = [r["least_m"] for r in rows if "least_m" in r]
    return out | ({"least_m": min(known)} if known else {})
