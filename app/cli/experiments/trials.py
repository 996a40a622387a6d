"""Experiments of trials: one command each, all with the same flags."""

from contextlib import nullcontext
from dataclasses import dataclass
from typing import ClassVar

from app.cli.experiments.running import Running
from app.cli.experiments.told import write_told
from app.cli.seed import Seed
from app.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class Trials(Running):
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
    rate: float = 125.0
    """Ticks a second [Hz]."""
    seed: Seed = 0
    """Seed of the first trial."""
    world: str = "honest"
    """Error budget of the simulation: honest or ideal, and single parts: honest,mounting=0."""
    skin: str = ""
    """A sensor layout's name or the path of its TOML file; the robot's own where left out."""

    def __post_init__(self) -> None:
        trials = 1 if self.trials is None else self.trials
        seconds = 1.0 if self.seconds is None else self.seconds
        if min(self.jobs, trials) < 1 or not 0.1 <= seconds < 1e6:
            raise ConfigError("trials and jobs must be positive, seconds at least 0.1")
        if not 50.0 <= self.rate <= 500.0:
            raise ConfigError(f"rate = {self.rate:g}; give 50 to 500")
        super().__post_init__()

    def __call__(self) -> None:
        from app.studies.check import check_study
        from app.studies.folder import Folder
        from app.studies.report import check_report
        from app.studies.study import Part, Study, tell

        study = Study(
            self.experiment, tuple(filter(None, self.conditions.split(","))), self.trials,
            self.seconds, self.seed, self.world, self.rate, self.skin,
        )  # fmt: skip
        check_study(study)
        if self.out is not None:
            check_report()
        folder = None if self.out is None else Folder(self.out)
        with self.stoppable(), nullcontext() if folder is None else folder.writing(self.shard):
            part = Part(study, study.log())
            if folder is not None:
                part = folder.part(study, self.shard)
                folder.begin(study)
            self.run(self.experiment, [part])
            if folder is not None:
                part = folder.part(study, self.shard)  # and what others have done meanwhile
            results = part.results()
            report = tell(study, results)
            if folder is not None:
                folder.write(study, results, report)
                if len(results) == len(study.specs()):  # else the last shard does
                    write_told(study, results, report, folder.path)
        self.show(report)


@dataclass(frozen=True, kw_only=True)
class Hri(Trials):
    """Repeat the paper's trials beside a person, with the paper's figures next to ours."""

    experiment = "hri"
