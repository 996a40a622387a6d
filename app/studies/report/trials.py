"""The trials of a study, sorted for the report: by condition, and by which are compared."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from app.config import Params
from app.studies.bootstrap import Interval, bootstrap
from app.studies.conditions import ALONE, ORACLE, Condition
from app.studies.experiment import Experiment, experiment_of
from app.studies.paired import Paired, paired
from app.studies.report.words import FIGURES, figure_of
from app.studies.study import Study
from app.studies.trial import TrialResult

EACH = 6  # conditions that are compared each with each; of more, each with the first
NONE = Interval(np.nan, np.nan, np.nan)


@dataclass(frozen=True, eq=False)
class Trials:
    """What is told of; those that died are apart, and so are those that others only refer to.

    of: trials by condition, in the order of conditions, by seed.
    """

    study: Study
    results: Sequence[TrialResult]
    kind: Experiment = field(init=False)
    of: dict[str, list[TrialResult]] = field(init=False)
    died: list[TrialResult] = field(init=False)
    _alone: dict[str, TrialResult] = field(init=False)

    def __post_init__(self) -> None:
        kind = experiment_of(self.study.experiment)
        good = [r for r in self.results if not r.fault]
        names = list(dict.fromkeys(r.condition for r in good))
        alone = {n for n in names if n.endswith(ALONE)}
        apart = alone - set(kind.wanted(self.study.conditions))
        object.__setattr__(self, "kind", kind)
        object.__setattr__(self, "died", [r for r in self.results if r.fault])
        object.__setattr__(self, "_alone", {r.condition: r for r in good if r.condition in alone})
        by = {n: [r for r in good if r.condition == n] for n in names if n not in apart}
        order = {n: sorted(rs, key=lambda r: r.seed) for n, rs in by.items()}
        object.__setattr__(self, "of", order)

    def read(self, name: str) -> Condition | None:
        """The condition, taken apart; None where the experiment's are of another kind."""
        return self.kind.read(name) if self.kind.check is None else None

    def values(self, name: str, key: str) -> dict[int, float]:
        """A figure of a condition by seed, where there is a finite number."""
        found = {r.seed: self._value(r, key) for r in self.of[name]}
        return {seed: v for seed, v in found.items() if np.isfinite(v)}

    def _value(self, r: TrialResult, key: str) -> float:
        if key != "work":
            value = r.figures.get(key)
            return float(value) if isinstance(value, int | float) else np.nan
        for other in self.kind.before([r.condition]):
            free = self._alone[other].figures["waypoints_per_min"] if other in self._alone else 0.0
            if free:
                return float(r.figures["waypoints_per_min"] / free)
        return np.nan

    def figures(self) -> list[str]:
        """Figures that there are, those described in `words` first."""
        found = dict.fromkeys(k for rs in self.of.values() for r in rs for k in r.figures)
        numbers = [k for k in (*FIGURES, *found) if any(self.values(n, k) for n in self.of)]
        return list(dict.fromkeys(numbers))

    def looked_at(self) -> list[str]:
        """The figures that the experiment is about."""
        keys = self.figures()
        return [k for k in self.kind.looked_at if k in keys] or keys[:4]

    def over(self, name: str, key: str) -> Interval:
        """A figure over the trials of a condition; limits where it is a mean of several."""
        values = list(self.values(name, key).values())
        if not values:
            return NONE
        how = figure_of(key).over
        if how == "mean":
            mean = bootstrap(values)
            return mean if len(values) > 1 else Interval(mean.mean, np.nan, np.nan)
        value = {"least": min(values), "largest": max(values), "sum": sum(values)}[how]
        return Interval(value, np.nan, np.nan)

    def difference(self, a: str, b: str, key: str) -> Paired:
        """a - b seed by seed."""
        return paired(self.values(a, key), self.values(b, key))

    def is_oracle(self, name: str) -> bool:
        """Does it perceive the truth?"""
        c = self.read(name)
        return name.startswith(ORACLE) if c is None else c.oracle

    def sides(self) -> list[list[str]]:
        """Conditions that may be compared: those of one side, and of one variant."""
        by: dict[tuple[str, str], list[str]] = {}
        for name in self.of:
            c = self.read(name)
            by.setdefault((c.side, c.variant) if c is not None else ("", ""), []).append(name)
        return list(by.values())

    def pairs(self) -> list[tuple[str, str]]:
        """(a, b) of which a - b is told: ours with the others first, then the others."""
        found: list[tuple[str, str]] = []
        for side in self.sides():
            names = [n for n in side if not self.is_oracle(n)]
            if len(names) > EACH:
                found += [(n, names[0]) for n in names[1:]]
            else:
                found += [(b, a) for a, b in combinations(names, 2)]
        return sorted(found, key=lambda pair: not self.is_ours(pair[0]))

    def gaps(self) -> list[tuple[str, str]]:
        """(condition, oracle) of which the difference is told."""
        return [
            (n, o) for side in self.sides() for o in side if self.is_oracle(o)
            for n in side if not self.is_oracle(n)
        ]  # fmt: skip

    def is_ours(self, name: str) -> bool:
        """Is it of the controller that runs unless another is asked for?"""
        c = self.read(name)
        return c is not None and c.mode == Params().mode
