"""Processes of this machine."""

from collections.abc import Iterator, Sequence

from app.studies.engines import Means, Run, Trial
from app.studies.pool import apart
from app.studies.trial import TrialResult, TrialSpec


def engine(means: Means, place: str = "") -> Run:
    """`means.jobs` processes; a trial that dies twice or takes too long has its cause."""
    return lambda trial, specs: apart(trial, specs, means.jobs, means.fate)


def locally(jobs: int = 1) -> Run:
    """On this machine in `jobs` processes; with one in this very process, with no limit."""
    return here if jobs == 1 else engine(Means(jobs))


def here(trial: Trial, specs: Sequence[TrialSpec]) -> Iterator[tuple[TrialSpec, TrialResult]]:
    """One after another in this process."""
    return ((spec, trial(spec)) for spec in specs)
