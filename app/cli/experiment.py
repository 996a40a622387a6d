"""`flinch experiment`: controllers against each other."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from app.errors import ConfigError


@dataclass(frozen=True)
class Experiment:
    """Run controllers against each other: `worlds` in random worlds, `tradeoff` in the
    paper's scenes over the distance that is kept. Takes minutes; hours with many worlds."""

    what: tyro.conf.Positional[Literal["worlds", "tradeoff"]]
    worlds: int = 30
    """Number of random worlds."""
    seconds: float = 10.0
    """Length of each run [s]."""
    cell_seconds: float = 40.0
    """tradeoff: length of the runs beside the person [s]."""
    seeds: int = 3
    """tradeoff: number of runs of each point beside the person, each with its own seed."""
    seed: int = 0
    """Seed of the first world, of the noise and of the people's habits."""
    log: Path | None = None
    """worlds: a file that each run is added to; what is in it already is not run again."""
    plot: Path | None = None
    """tradeoff: also draw the points into this PNG or SVG file."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if min(self.worlds, self.seeds) < 1 or not (
            0.0 < self.seconds < 1e6 and 0.0 < self.cell_seconds < 1e6
        ):
            raise ConfigError("worlds, seeds, seconds and cell-seconds must be positive")

        if self.plot is not None:
            if self.what != "tradeoff":
                raise ConfigError("plot is for tradeoff only; leave it out with worlds")
            from app.plot import check_plot

            check_plot(self.plot)

    def __call__(self) -> None:
        if self.what == "worlds":
            from app.studies.random_worlds import random_worlds

            report = random_worlds(self.worlds, self.seconds, self.seed, log=self.log)
        else:
            from app.studies.tradeoff import tradeoff

            report = tradeoff(
                seconds=self.seconds, cell_seconds=self.cell_seconds, seed=self.seed,
                seeds=self.seeds,
            )  # fmt: skip
            if self.plot is not None:
                from app.plot import plot_tradeoff

                plot_tradeoff(report.rows, self.plot)
        print(report.to_json() if self.json else report.to_text())
