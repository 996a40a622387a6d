"""`flinch calibrate filter`: thresholds of the self filter."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from app.cli.seed import Seed
from app.cli.which import WhichRobot


@dataclass(frozen=True)
class CalibrateFilter(WhichRobot):
    """Suggest the self filter's threshold of each link from returns of the robot itself."""

    recording: tyro.conf.Positional[str]
    """'simulated', or PATH[@SENSOR]: an arm at rest at home with nothing near it."""
    ranges: Path | None = None
    """Table of each zone's range error, from `flinch calibrate ranges`."""
    seed: Seed = 0
    """Seed of a simulated calibration."""
    world: str = "honest"
    """How far the simulated truth is from the layout: as in `flinch run`."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.checks.filter_calibration import calibrate

        setup = self.setup(seed=self.seed, ranges=self.ranges, world=self.world)
        report = calibrate(setup, self.recording)
        print(report.to_json() if self.json else report.to_text())
