"""`flinch calibrate ranges`: what each zone's range is wrong by."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from app.cli.seed import Seed
from app.cli.which import WhichRobot


@dataclass(frozen=True)
class CalibrateRanges(WhichRobot):
    """Measure each zone's range error from a flat wall shown square at a known distance."""

    recording: tyro.conf.Positional[str]
    """'simulated', or PATH[@SENSOR] of a recording of the wall."""
    file: tyro.conf.Positional[Path]
    """Table to begin or to add to; `flinch run --ranges FILE` uses it."""
    distance: float = 0.0
    """Distance of a recorded wall from the lens [m]."""
    seed: Seed = 0
    """Seed of the simulated sensors."""
    world: str = "honest"
    """How far the simulated truth is from the layout: as in `flinch run`."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.checks.range_calibration import calibrate_ranges

        setup = self.setup(seed=self.seed, world=self.world)
        report = calibrate_ranges(setup, self.recording, self.distance, self.file)
        print(report.to_json() if self.json else report.to_text())
