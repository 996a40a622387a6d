"""`flinch experiment tradeoff`: clearance against goal in the paper's scenes."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from app.cli.seed import Seed
from app.errors import ConfigError


@dataclass(frozen=True)
class Tradeoff:
    """Run every controller in the paper's scenes, over the distance that is kept."""

    scenes: tuple[Literal["front-panel", "side-panel", "cell"], ...] = (
        "front-panel", "side-panel", "cell",
    )  # fmt: skip
    """The plates, and the cell with its person."""
    kept: tuple[float, ...] = (0.10, 0.15, 0.20, 0.25, 0.30)
    """Distances that are kept [m]."""
    seconds: float = 8.0
    """Length of each run before a plate [s]."""
    cell_seconds: float = 40.0
    """Length of the runs beside the person [s]."""
    seeds: int = 3
    """Number of runs of each point, each with its own seed."""
    seed: Seed = 0
    """Seed of the noise and of the people's habits."""
    jobs: int = 1
    """Number of processes."""
    world: str = "honest"
    """Error budget of the simulation: honest or ideal, and single parts: honest,mounting=0."""
    plot: Path | None = None
    """Also draw the points into this PNG or SVG file."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if not (self.scenes and self.kept):
            raise ConfigError("scenes and kept must not be empty; give one of each, or leave out")
        if min(self.seeds, self.jobs) < 1 or not (
            0.0 < self.seconds < 1e6 and 0.0 < self.cell_seconds < 1e6
        ):
            raise ConfigError("seeds, jobs, seconds and cell-seconds must be positive")
        if self.plot is not None:
            from app.plot import check_plot

            check_plot(self.plot)

    def __call__(self) -> None:
        from app.studies.tradeoff import Extent, tradeoff

        extent = Extent(self.scenes, self.kept, self.seconds, self.cell_seconds, self.seeds)
        report = tradeoff(extent, self.seed, jobs=self.jobs, world=self.world)
        if self.plot is not None:
            from app.plot import plot_tradeoff

            plot_tradeoff(report.rows, self.plot)
        print(report.to_json() if self.json else report.to_text())
