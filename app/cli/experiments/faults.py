"""`flinch experiment faults`: sensors that fail while the arm works."""

from dataclasses import dataclass

from app.errors import ConfigError


@dataclass(frozen=True)
class Faults:
    """Let sensors fail, in every way and number, and say what the arm ran into and what it cost."""

    seconds: float = 10.0
    """Length of each run [s]."""
    seeds: int = 1
    """Number of runs of each fault, each in a world of its own."""
    seed: int = 0
    """Seed of the first world, and of which sensors fail in the cell."""
    world: str = "honest"
    """The simulated world's errors: honest or ideal, each with single parts, honest,mounting=0."""
    jobs: int = 1
    """Number of processes."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if min(self.seeds, self.jobs) < 1 or not 1.0 <= self.seconds < 1e6:
            raise ConfigError("seeds and jobs must be positive, seconds at least 1")

    def __call__(self) -> None:
        from app.studies.faults import faults

        report = faults(self.seconds, self.seed, self.seeds, world=self.world, jobs=self.jobs)
        print(report.to_json() if self.json else report.to_text())
