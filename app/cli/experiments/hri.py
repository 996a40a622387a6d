"""`flinch experiment hri`: the paper's table, of a person beside the arm."""

from dataclasses import dataclass
from pathlib import Path

from app.errors import ConfigError


@dataclass(frozen=True)
class Hri:
    """Repeat the paper's trials beside a person, with the paper's figures next to ours."""

    trials: int = 10
    """Number of trials of each condition, each with a seed of its own."""
    seconds: float = 60.0
    """Length of each trial [s]."""
    seed: int = 0
    """Seed of the first trial."""
    conditions: str = "SR,SL,WBR,WBL,QPR,QPL"
    """Controllers and sides, separated by commas: S (sensor mounts), WB, QP or paper (WB strictly
    as published), each with R or L."""
    jobs: int = 1
    """Number of processes."""
    shard: str = "1/1"
    """I/N: only every N-th trial from the I-th on, for several machines."""
    log: Path | None = None
    """A file that each trial is added to; what is in it already is not run again. Files of shards
    can be joined with cat."""
    world: str = "honest"
    """Error budget of the simulation: honest or ideal, and single parts: honest,mounting=0."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if min(self.trials, self.jobs) < 1 or not 1.0 <= self.seconds < 1e6:
            raise ConfigError("trials and jobs must be positive, seconds at least 1")

    def __call__(self) -> None:
        from app.studies.hri import HriStudy, hri

        report = hri(
            HriStudy(
                tuple(filter(None, self.conditions.split(","))), self.trials, self.seconds,
                self.seed, self.world, jobs=self.jobs, shard=self.shard, log=self.log,
            )
        )  # fmt: skip
        print(report.to_json() if self.json else report.to_text())
