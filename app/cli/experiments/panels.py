"""`flinch experiment panels`: the whole body against sensor mounts before the paper's panels."""

from dataclasses import dataclass

from app.errors import ConfigError


@dataclass(frozen=True)
class Panels:
    """How much farther the whole body stays from a panel than the sensors' mounts do, with the
    95 % interval of the mean over the seeds."""

    seeds: int = 10
    """Number of runs of each controller before each panel."""
    seconds: float = 8.0
    """Length of each run [s]."""
    seed: int = 0
    """Seed of the first run."""
    jobs: int = 1
    """Number of processes."""
    world: str = "honest"
    """Error budget of the simulation: honest or ideal, and single parts: honest,mounting=0."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if min(self.seeds, self.jobs) < 1 or not 2.0 < self.seconds < 1e6:
            raise ConfigError("seeds and jobs must be positive, seconds more than 2")

    def __call__(self) -> None:
        from app.studies.panels import panels

        report = panels(self.seeds, self.seconds, self.seed, jobs=self.jobs, world=self.world)
        print(report.to_json() if self.json else report.to_text())
