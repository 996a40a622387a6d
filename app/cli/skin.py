"""`flinch skin` and `flinch calibrate-filter`: is the skin as its layout says?"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro


@dataclass(frozen=True)
class CalibrateFilter:
    """Suggest the self filter's threshold of each link from returns of the robot itself."""

    recording: tyro.conf.Positional[str]
    """'simulated', or PATH[@SENSOR]: an arm at rest at home with nothing near it."""
    robot: str = "ur10e"
    """A robot's name, or the path of its folder."""
    skin: str = ""
    """Path of a sensor layout; default: the robot's own."""
    ranges: Path | None = None
    """Table of each zone's range error, from `flinch calibrate-ranges`."""
    seed: int = 0
    """Seed of a simulated calibration."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.studies.calibrate import calibrate

        report = calibrate(self.robot, self.recording, self.skin, self.seed, self.ranges)
        print(report.to_json() if self.json else report.to_text())


@dataclass(frozen=True)
class SkinCommand:
    """Check a sensor against the layout: convention of its ranges, order of its zones."""

    what: tyro.conf.Positional[Literal["check"]]
    show: Literal["wall", "hand"] = "wall"
    """A flat wall, or a hand that goes from left to right and then from top to bottom."""
    sensors: str = "simulated"
    """'simulated[@SENSOR]' or PATH[@SENSOR] of a recording."""
    robot: str = "ur10e"
    """A robot's name, or the path of its folder."""
    seed: int = 0
    """Seed of the simulated noise."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.studies.skin_check import skin_check

        report = skin_check(self.robot, self.show, self.sensors, self.seed)
        print(report.to_json() if self.json else report.to_text())
