"""`flinch experiment matrix`: layouts by conditions, from one file."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from app.cli.experiments.running import Running
from app.errors import ConfigError


@dataclass(frozen=True, kw_only=True)
class Matrix(Running):
    """Try sensor layouts against each other: every layout in every condition, with one row each;
    static_assets/studies/hri-layouts.toml shows how."""

    file: tyro.conf.Positional[Path]
    """What is tried: an experiment, layouts, conditions, trials, seconds, worlds; a TOML file."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.out is None:
            raise ConfigError("a matrix needs a folder for its cells; give --out DIR")

    def __call__(self) -> None:
        from app.studies.matrix import opened, read_matrix, tell_matrix

        assert self.out is not None
        cells = read_matrix(self.file)
        with self.stoppable(), opened(cells, self.out, self.shard) as parts:
            self.run(self.file.stem, parts)
            report = tell_matrix(cells, self.out, self.shard)
        self.show(report)
