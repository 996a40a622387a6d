"""Experiments of trials: one command each, all with the same flags."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from app.cli.experiments.told import write_told
from app.errors import ConfigError


@dataclass(frozen=True)
class Trials:
    """Trials of an experiment, and what came of them."""

    experiment: ClassVar[str]

    conditions: str = ""
    """Controllers, with their side (R, L) where there are two, separated by commas: S (sensor
    mounts), WB, QP, paper (WB strictly as published), oracle, or any other's name; then what is
    left out or added: QPL-memory, QPL+dead:3, QPL+calibrated, QPL+set:distance_kept=0.2. The
    experiment's own where left out."""
    trials: int | None = None
    """Number of trials of each condition, each with a seed of its own."""
    seconds: float | None = None
    """Length of each trial [s]."""
    seed: int = 0
    """Seed of the first trial."""
    world: str = "honest"
    """Error budget of the simulation: honest or ideal, and single parts: honest,mounting=0."""
    skin: str = ""
    """A sensor layout's name or the path of its TOML file; the robot's own where left out."""
    jobs: int = 1
    """Number of processes."""
    shard: str = "1/1"
    """I/N: only every N-th trial from the I-th on, for several machines."""
    out: Path | None = None
    """A folder for all that comes of it; trials that are in it already are not run again."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        trials = 1 if self.trials is None else self.trials
        seconds = 1.0 if self.seconds is None else self.seconds
        if min(self.jobs, trials) < 1 or not 0.1 <= seconds < 1e6:
            raise ConfigError("trials and jobs must be positive, seconds at least 0.1")

    def __call__(self) -> None:
        from app.studies.report import check_report
        from app.studies.study import Study, locally, run_study, tell

        study = Study(
            self.experiment, tuple(filter(None, self.conditions.split(","))), self.trials,
            self.seconds, self.seed, self.world, skin=self.skin,
        )  # fmt: skip
        log = None
        if self.out is not None:
            check_report()
            self.out.mkdir(parents=True, exist_ok=True)
            log = self.out / "trials.jsonl"
        results = run_study(study, locally(self.jobs), log, self.shard)
        report = tell(study, results)
        if self.out is not None:
            write_told(study, results, report, self.out)
        print(report.to_json() if self.json else report.to_text())


@dataclass(frozen=True)
class Hri(Trials):
    """Repeat the paper's trials beside a person, with the paper's figures next to ours."""

    experiment = "hri"
