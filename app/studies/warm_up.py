"""Kernels are compiled once, before several processes would each compile the same ones."""

import re
from collections.abc import Iterable, Iterator, Sequence

from app.studies.engines import Means, Run, Trial
from app.studies.engines.local import engine
from app.studies.experiment import experiment_of
from app.studies.trial import TrialResult, TrialSpec

MOMENT = 0.3  # [s] in which every kernel of a tick is called
COMPILED = 3600.0  # [s] by when all of them are, on the slowest machine


def warmed(run: Run) -> Run:
    """`run`, after a moment of one trial of each controller in a process of this machine."""

    def first(trial: Trial, specs: Sequence[TrialSpec]) -> Iterator[tuple[TrialSpec, TrialResult]]:
        for _ in engine(Means(limit=COMPILED))(trial, moments(specs)):
            pass  # a trial that dies at once will do so again, and is told of then
        yield from run(trial, specs)

    return first


def moments(specs: Iterable[TrialSpec]) -> list[TrialSpec]:
    """One short trial for each controller."""
    one = {(s.experiment, _controller(s)): s for s in specs}
    return [s._replace(seconds=min(MOMENT, s.seconds)) for s in one.values()]


def _controller(spec: TrialSpec) -> str:
    """The controller of a condition, where conditions are such."""
    kind = experiment_of(spec.experiment)
    if kind.run is not None or kind.check is not None:
        return re.split(r"[ +-]", spec.condition)[0]
    return kind.read(spec.condition).mode
