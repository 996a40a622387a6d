"""Flags that all studies share: where their trials run, and what is kept of them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from app.errors import ConfigError, StudyError

if TYPE_CHECKING:
    from app.report import Report
    from app.studies.study import Part


@dataclass(frozen=True, kw_only=True)
class Running:
    """Where trials run, and what is kept of them."""

    engine: str = "local"
    """Where trials run: local (processes), ray (begun here), ray:HOST:PORT (a Ray cluster that
    runs already), submitit or submitit:PARTITION (SLURM). The results are the same."""
    jobs: int = 1
    """Number of trials at once; of SLURM, number of jobs at once."""
    limit: float | None = None
    """How long a trial may take [s]; default: 30 times its length and five minutes."""
    shard: str = "1/1"
    """I/N: only every N-th trial from the I-th on, for several machines, into one folder or
    several."""
    out: Path | None = None
    """A folder for all that comes of it; trials that are in it already are not run again."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if self.jobs < 1 or (self.limit is not None and not self.limit > 0.0):
            raise ConfigError("jobs and limit must be positive")

    def run(self, what: str, parts: "Sequence[Part]") -> None:
        """Run what is missing."""
        from app.cli.experiments.progress import Pace, shown
        from app.studies.engines import Means, engine_of
        from app.studies.study import run_parts
        from app.studies.warm_up import warmed

        jobs = None if self.out is None else self.out / "jobs"
        run = engine_of(self.engine, Means(self.jobs, self.limit, jobs))
        elsewhere = self.engine.startswith("ray:")  # its machines have kernels of their own
        if not elsewhere and (self.jobs > 1 or self.engine != "local"):
            run = warmed(run)
        with shown(what, Pace(), self.json) as show:
            run_parts(parts, run, self.shard, show)

    @contextmanager
    def stoppable(self) -> Iterator[None]:
        """While this lasts a Ctrl-C is one line, which says how to go on."""
        try:
            yield
        except KeyboardInterrupt:
            kept = "nothing is kept without --out DIR"
            if self.out is not None:
                kept = f"what is done is kept in {self.out}, and the same command goes on from it"
            raise StudyError(f"stopped; {kept}") from None

    def show(self, report: "Report") -> None:
        """Print what came of it."""
        print(report.to_json() if self.json else report.to_text())
