"""`flinch experiment ranges`: simulated range errors beside those of real sensors."""

from dataclasses import dataclass
from pathlib import Path

from app.cli.seed import Seed
from app.errors import ConfigError


@dataclass(frozen=True)
class Ranges:
    """How wrong simulated ranges are, by distance, angle and shade of a wall, beside what was
    published and measured of the real sensor."""

    frames: int = 150
    """Number of frames of each wall."""
    seeds: int = 6
    """Number of sensors that look at each wall, each with its own seed."""
    seed: Seed = 0
    """Seed of the first of them."""
    data: Path | None = None
    """A folder with recorded frames (state_ToF.csv) to set beside them."""
    plot: Path | None = None
    """Also draw the curves into this PNG or SVG file."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if self.frames < 15 or self.seeds < 1:
            raise ConfigError("frames must be at least 15, seeds at least 1")
        if self.data is not None and not self.data.is_dir():
            raise ConfigError(f"data = {self.data}: is no folder; give one with recorded frames")
        if self.plot is not None:
            from app.plot import check_plot

            check_plot(self.plot)

    def __call__(self) -> None:
        from app.studies.range_errors import MEASURED, range_errors

        report = range_errors(self.frames, self.seeds, self.seed, self.data)
        if self.plot is not None:
            from app.plot import plot_ranges

            plot_ranges(report.rows, MEASURED, self.plot)
        print(report.to_json() if self.json else report.to_text())
