"""`flinch experiment`: controllers, filters and faults tried against each other; one file each."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from app.cli.experiments.clutter import Clutter
from app.cli.experiments.frontier import Frontier
from app.cli.experiments.matrix import Matrix
from app.cli.experiments.mounts import Mounts
from app.cli.experiments.phantoms import Phantoms
from app.cli.experiments.ranges import Ranges
from app.cli.experiments.scenes import (
    Approach,
    Elementary,
    Faults,
    FrontPanel,
    Occlusion,
    SidePanel,
    Worlds,
)
from app.cli.experiments.tradeoff import Tradeoff
from app.cli.experiments.trials import Hri


@dataclass(frozen=True)
class Experiment:
    """Try things against each other, in simulation. Takes minutes; hours with many runs."""

    what: tyro.conf.OmitArgPrefixes[
        Annotated[Worlds, tyro.conf.subcommand("worlds", prefix_name=False)]
        | Annotated[Mounts, tyro.conf.subcommand("mounts", prefix_name=False)]
        | Annotated[Faults, tyro.conf.subcommand("faults", prefix_name=False)]
        | Annotated[FrontPanel, tyro.conf.subcommand("front-panel", prefix_name=False)]
        | Annotated[SidePanel, tyro.conf.subcommand("side-panel", prefix_name=False)]
        | Annotated[Hri, tyro.conf.subcommand("hri", prefix_name=False)]
        | Annotated[Approach, tyro.conf.subcommand("approach", prefix_name=False)]
        | Annotated[Matrix, tyro.conf.subcommand("matrix", prefix_name=False)]
        | Annotated[Occlusion, tyro.conf.subcommand("occlusion", prefix_name=False)]
        | Annotated[Clutter, tyro.conf.subcommand("clutter", prefix_name=False)]
        | Annotated[Elementary, tyro.conf.subcommand("elementary", prefix_name=False)]
        | Annotated[Phantoms, tyro.conf.subcommand("phantoms", prefix_name=False)]
        | Annotated[Frontier, tyro.conf.subcommand("frontier", prefix_name=False)]
        | Annotated[Ranges, tyro.conf.subcommand("ranges", prefix_name=False)]
        | Annotated[Tradeoff, tyro.conf.subcommand("tradeoff", prefix_name=False)]
    ]

    def __call__(self) -> None:
        self.what()
