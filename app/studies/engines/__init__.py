"""Where trials are run, one file each: processes here, a Ray cluster, a SLURM cluster.

All have one shape, `Run`, and give the same results: a trial is a pure function of its
specification.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType

from app.errors import ConfigError, options
from app.studies.pool import Fate
from app.studies.trial import TrialResult, TrialSpec

Trial = Callable[[TrialSpec], TrialResult]
# Runs trials somewhere and gives back each with its result when it is there, in any order.
Run = Callable[[Trial, Sequence[TrialSpec]], Iterator[tuple[TrialSpec, TrialResult]]]
ENGINES = ("local", "ray", "submitit")
LOST = "the trial gave no result: "  # its machine's fault, not its own: it is run again
SLOWEST, START = 30.0, 300.0  # a trial may take so many times its length, and [s] for compiling


@dataclass(frozen=True)
class Means:
    """What an engine has to work with.

    jobs:   number of trials at once.
    limit:  [s] of the wall's clock for one trial; None: by its length.
    folder: where a cluster's own files go; None: the study keeps nothing.
    """

    jobs: int = 1
    limit: float | None = None
    folder: Path | None = None

    def seconds(self, spec: TrialSpec) -> float:
        """How long a trial may take [s]."""
        return SLOWEST * spec.seconds + START if self.limit is None else self.limit

    @property
    def fate(self) -> Fate[TrialSpec, TrialResult]:
        """Of trials that give no result."""
        return Fate(lost, self.seconds)


def lost(spec: TrialSpec, cause: str) -> TrialResult:
    """The row of a trial that gave no result."""
    return TrialResult(spec.seed, spec.condition, fault=LOST + cause)


def engine_of(name: str, means: Means) -> Run:
    """The engine of a name, with an address or a part of the cluster behind a colon."""
    kind, _, place = name.partition(":")
    if kind not in ENGINES:
        raise ConfigError(f"engine = {name!r}; {options(kind, ENGINES)}")
    if kind == "local" and name != kind:
        raise ConfigError(f"engine = {name!r}: local has no address; give local, or ray:{place}")
    module = import_module(f"{__name__}.{kind}")
    run: Run = module.engine(means, place)
    return run


def needed(package: str, extra: str) -> ModuleType:
    """An optional package; ConfigError where it is missing."""
    try:
        return import_module(package)
    except ModuleNotFoundError as e:
        raise ConfigError(
            f"--engine {package} needs the package {e.name}; pip install -e '.[{extra}]'"
        ) from e
