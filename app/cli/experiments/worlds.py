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
    """Length of each run [s]."""
    seed: int = 0
    """Seed of the first world."""
    log: Path | None = None
    """A file that each run is added to; what is in it already is not run again."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if self.worlds < 1 or not 0.0 < self.seconds < 1e6:
            raise ConfigError("worlds and seconds must be positive")

    def __call__(self) -> None:
        from app.studies.random_worlds import random_worlds

        report = random_worlds(self.worlds, self.seconds, self.seed, log=self.log)
        print(report.to_json() if self.json else report.to_text())
