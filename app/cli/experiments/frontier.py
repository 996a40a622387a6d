"""`flinch experiment frontier`: what the margins of the self filter cost."""

from dataclasses import dataclass
from pathlib import Path

from app.cli.seed import Seed
from app.errors import ConfigError


@dataclass(frozen=True)
class Frontier:
    """Obstacles kept right before the body against returns of it that pass, over the margins."""

    postures: int = 150
    """Number of postures of each arm."""
    seeds: int = 2
    """Number of arms, each with its own errors."""
    seed: Seed = 0
    """Seed of the first arm."""
    world: str = "honest"
    """Error budget of the simulation: 'honest', or with single parts, 'honest,body=0'."""
    plot: Path | None = None
    """Also draw the frontier into this PNG or SVG file."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if min(self.postures, self.seeds) < 1:
            raise ConfigError("postures and seeds must be positive")
        if self.plot is not None:
            from app.plot import check_plot

            check_plot(self.plot)

    def __call__(self) -> None:
        from app.studies.frontier import frontier

        report = frontier(self.postures, self.seeds, self.seed, self.world)
        if self.plot is not None:
            from app.plot import plot_frontier

            plot_frontier(report.rows, self.plot)
        print(report.to_json() if self.json else report.to_text())
