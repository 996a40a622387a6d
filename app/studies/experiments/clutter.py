"""X8: reach into narrow places, with the whole map (the oracle) and with sensors only.

A trial's seed is the problem's number: of one of our own sets, or of a folder of problems of
MotionBenchMaker's, which is begun anew after its last. Reactive control solves only some; who
touches something has not solved it, and who neither arrives nor touches anything is blocked. The
distance kept is small, since these places are narrow.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from app.control.goals import goal_error
from app.errors import ConfigError, options
from app.messages import Snapshot
from app.report import Check
from app.runtime import Engine
from app.studies.case import Case, run_case, setup_of
from app.studies.clutter.moveit import load_problem, requests_of
from app.studies.clutter.own import SETS, problem_of
from app.studies.clutter.problem import Problem, trouble
from app.studies.conditions import Condition
from app.studies.experiment import Experiment, Told, register
from app.studies.rows import grouped
from app.studies.trial import TrialResult, TrialSpec
from app.studies.world_trial import stage

KEPT = 0.08  # [m] unless a condition says otherwise
THERE, TURNED = 0.02, 0.1  # [m], [rad] of a tool that has arrived
OUTCOMES = ("success", "contact", "blocked")
KEY = "distance_kept"


class Arrival:
    """When the tool was first where it should go."""

    def __init__(self, engine: Engine) -> None:
        self._at, self._error = np.nan, (np.nan, np.nan)

    def update(self, s: Snapshot) -> None:
        """Take note of one tick."""
        self._error = goal_error(s.T_base_tool, s.goal.T_base_tool)
        if np.isnan(self._at) and self._error[0] <= THERE and self._error[1] <= TURNED:
            self._at = s.stamp

    def figures(self) -> dict[str, Any]:
        """arrived_s: NaN for never; the errors are those at the end."""
        return {
            "arrived_s": self._at, "goal_error_m": self._error[0], "goal_error_rad": self._error[1],
        }  # fmt: skip

    def marks(self) -> list[list[Any]]:
        """[stamp, words] of the arrival."""
        return [] if np.isnan(self._at) else [[self._at, "the tool has arrived"]]


def check_set(variant: str) -> None:
    """ConfigError for what is neither a set of ours nor a folder of problems."""
    if not Path(variant).is_dir():
        known = options(variant, SETS)
        raise ConfigError(f"problems {variant!r}: neither a folder nor a set; {known}")
    requests_of(Path(variant))


def found(variant: str, number: int) -> tuple[Problem, str]:
    """A problem of a set, and why it is none for this arm, if it is none."""
    robot, _, truth = stage()
    if variant in SETS:
        return problem_of(robot, truth, variant, number), ""
    requests = requests_of(Path(variant))
    problem, seed = load_problem(requests[number % len(requests)])
    return problem, trouble(robot, truth, problem, seed)


def run(spec: TrialSpec) -> TrialResult:
    """One problem; one that is none for this arm is told, and not tried."""
    c = CLUTTER.read(spec.condition)
    problem, why = found(c.variant, spec.seed)
    if why:
        return TrialResult(spec.seed, spec.condition, {"problem": problem.name, "dropped": why})
    result = run_case(spec, c, prepared(spec, c, problem))
    result.figures["problem"] = problem.name
    result.figures["outcome"] = outcome(result.figures)
    return result


def case(spec: TrialSpec, c: Condition) -> Case:
    """What a trial needs, whether it is run or only shown again."""
    return prepared(spec, c, found(c.variant, spec.seed)[0])


def prepared(spec: TrialSpec, c: Condition, problem: Problem) -> Case:
    """The arm in a narrow place of which it knows nothing."""
    params = c.params()
    if KEY not in dict(c.changes):
        params = replace(params, distance_kept=KEPT)
    scene = problem.scene(stage().robot)
    return Case(setup_of(spec, c, "empty"), params, Arrival, scene)


def outcome(figures: dict[str, Any]) -> str:
    """One of `OUTCOMES`."""
    if figures["contacts"]:
        return "contact"
    return "success" if np.isfinite(figures["arrived_s"]) else "blocked"


def told(good: Sequence[TrialResult]) -> Told:
    """A row for each condition and set, then which problems survived and why others did not."""
    rows = [row(name, trials) for name, trials in grouped(good).items()]
    tried = [t for t in good if "outcome" in t.figures]
    checks = [Check("problems that were tried", float(len(tried)), "", 1.0, at_least=True)]
    return Told([*rows, *surviving(good)], checks)


def row(name: str, trials: Sequence[TrialResult]) -> dict[str, Any]:
    """What came of the problems of one set."""
    tried = [t.figures for t in trials if "outcome" in t.figures]
    out: dict[str, Any] = {
        "name": name,
        "problems": len(tried),
        "dropped": len(trials) - len(tried),
    }
    if not tried:
        return out
    for what in OUTCOMES:
        out[what] = float(np.mean([f["outcome"] == what for f in tried]))
    times = [f["arrived_s"] for f in tried if f["outcome"] == "success"]
    if times:
        out["median_arrived_s"] = float(np.median(times))
    out["own_contacts"] = sum(f["own_contacts"] for f in tried)
    out["median_least_m"] = float(np.median([f["true_least_m"] for f in tried]))
    return out


def surviving(good: Sequence[TrialResult]) -> list[dict[str, Any]]:
    """Of each folder: the problems that are ones for this arm, and how many are not, and why."""
    rows = []
    seen: dict[str, dict[str, str]] = {}
    for t in good:
        variant = t.condition.partition("@")[2]
        if variant not in SETS:
            seen.setdefault(variant, {})[t.figures["problem"]] = t.figures.get("dropped", "")
    for variant, problems in seen.items():
        survive = sorted(name for name, why in problems.items() if not why)
        why = Counter(why for why in problems.values() if why)
        rows.append(
            {"name": f"surviving {variant}", "of": len(problems), "problems": " ".join(survive),
             "dropped": dict(why)}
        )  # fmt: skip
    return rows


CLUTTER = register(
    Experiment(
        "clutter", "Reach into narrow places: ours, and MotionBenchMaker's of a UR5.",
        ("oracle", "QP", "WB"), 10, 20.0, case, told, run=run,
        variants=tuple(SETS), variant=check_set, looked_at=("true_least_m", "arrived_s"),
    )
)  # fmt: skip
