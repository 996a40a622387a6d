"""`flinch calibrate`: what a real skin is, beside what its layout says; one file a part."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from app.cli.calibrate.filter import CalibrateFilter
from app.cli.calibrate.mounts import CalibrateMounts
from app.cli.calibrate.ranges import CalibrateRanges


@dataclass(frozen=True)
class Calibrate:
    """Find out what a real skin is: its zones' range errors, where its sensors sit, its
    self filter's thresholds."""

    what: tyro.conf.OmitArgPrefixes[
        Annotated[CalibrateRanges, tyro.conf.subcommand("ranges", prefix_name=False)]
        | Annotated[CalibrateMounts, tyro.conf.subcommand("mounts", prefix_name=False)]
        | Annotated[CalibrateFilter, tyro.conf.subcommand("filter", prefix_name=False)]
    ]

    def __call__(self) -> None:
        self.what()
