"""Experiments by name: what is tried, and how its trials are told of.

A file in `app/studies/experiments` makes one with `register`; the command line, the engines, the
report and the benchmark know none of them by name.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from app.errors import ConfigError, options
from app.report import Check
from app.studies.case import Case, run_case
from app.studies.conditions import AT, Condition, read_condition
from app.studies.trial import TrialResult, TrialSpec


class Told(NamedTuple):
    """A table: rows with a 'name' each, and checks."""

    rows: list[dict[str, Any]]
    checks: list[Check]


@dataclass(frozen=True)
class Experiment:
    """What is known of an experiment.

    name:       on the command line.   help: one line.
    conditions: those that are run unless others are asked for, of all variants.
    trials, seconds: so many of each condition, so long each, unless others are asked for.
    case:       what a trial needs, built in the process that runs it.
    tell:       the table of trials, in the order wanted; those that died are left out and told of
                by the study.
    sides:      conditions end with R or L.
    before:     conditions that the table also needs, run once, with the first seed.
    run:        runs a trial; None: by `app.studies.case.run_case`.
    check:      ConfigError for a condition that it cannot run; None: by the common grammar.
    variants:   of the situation; one that is asked for stands after @ in a condition.
    variant:    ConfigError for another variant that there is not; None: there are no others.
    paper:      what others have published, by condition and figure.
    verdicts:   what its checks are called that hold, and that do not.
    looked_at:  figures that it is about, for the report's pictures and comparisons.
    """

    name: str
    help: str
    conditions: tuple[str, ...]
    trials: int
    seconds: float
    case: Callable[[TrialSpec, Condition], Case] | None
    tell: Callable[[Sequence[TrialResult]], Told]
    sides: bool = False
    before: Callable[[Sequence[str]], list[str]] = lambda conditions: []
    run: Callable[[TrialSpec], TrialResult] | None = None
    check: Callable[[str], object] | None = None
    variants: tuple[str, ...] = ()
    variant: Callable[[str], object] | None = None
    paper: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    verdicts: tuple[str, str] = ("met", "not met")
    looked_at: tuple[str, ...] = (
        "steady_m", "true_least_m", "true_mean_m", "below_kept", "goal_error_m", "path_error_m",
    )  # fmt: skip

    def wanted(self, conditions: Sequence[str] = ()) -> tuple[str, ...]:
        """Those asked for, or its own; one without a variant stands for it in each of them."""
        out: list[str] = []
        for name in conditions or self.conditions:
            every = self.variants if AT not in name else ()
            out += [name + AT + variant for variant in every] or [name]
        return tuple(out)

    def read(self, condition: str) -> Condition:
        """The condition of a name; ConfigError for one that there is not."""
        return read_condition(condition, self.sides, self.variants, self.variant)

    def check_condition(self, condition: str) -> None:
        """ConfigError for a condition that this experiment cannot run."""
        (self.check or self.read)(condition)


_EXPERIMENTS: dict[str, Experiment] = {}


def register(experiment: Experiment) -> Experiment:
    """Make it known."""
    _EXPERIMENTS[experiment.name] = experiment
    return experiment


def experiments() -> dict[str, Experiment]:
    """All there are, by name."""
    import app.studies.experiments  # noqa: F401  # each registers itself

    return _EXPERIMENTS


def experiment_of(name: str) -> Experiment:
    """The experiment of a name; ConfigError for one that there is not."""
    known = experiments()
    if name not in known:
        raise ConfigError(f"no experiment {name!r}; {options(name, known)}")
    return known[name]


def run_spec(spec: TrialSpec) -> TrialResult:
    """The trial of a specification, in whatever process; one that dies is one with its cause."""
    try:
        experiment = experiment_of(spec.experiment)
        if experiment.run is not None:
            return experiment.run(spec)
        assert experiment.case is not None
        condition = experiment.read(spec.condition)
        return run_case(spec, condition, experiment.case(spec, condition))
    except Exception as error:
        return TrialResult(spec.seed, spec.condition, fault=f"the trial died: {error!r}")
