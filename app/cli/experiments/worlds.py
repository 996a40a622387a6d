"""`flinch experiment worlds`: controllers in random worlds."""

from dataclasses import dataclass
from pathlib import Path

from app.errors import ConfigError


@dataclass(frozen=True)
class Worlds:
    """Run every controller in the same random worlds, and say why it touched what it touched."""

    worlds: int = 30
    """Number of random worlds."""
    seconds: float = 10.0
    """Length of each run [s]; it ends before with a touch."""
    seed: int = 0
    """Seed of the first world."""
    jobs: int = 1
    """Number of processes."""
    shard: str = "1/1"
    """I/N: only every N-th world from the I-th on, for several machines."""
    log: Path | None = None
    """A file that each run is added to; what is in it already is not run again. Files of shards
    can be joined with cat."""
    world: str = "honest"
    """Error budget of the simulation: honest or ideal, and single parts: honest,mounting=0."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if min(self.worlds, self.jobs) < 1 or not 0.0 < self.seconds < 1e6:
            raise ConfigError("worlds, jobs and seconds must be positive")

    def __call__(self) -> None:
        from app.studies.random_worlds import random_worlds

        report = random_worlds(
            self.worlds, self.seconds, self.seed, log=self.log, jobs=self.jobs, shard=self.shard,
            world=self.world,
        )  # fmt: skip
        print(report.to_json() if self.json else report.to_text())
