"""Layouts by conditions by worlds, from one file, each cell a study of its own.

    experiment = "hri"
    layouts = ["forearm-rings", "mine.toml"]
    conditions = ["SL", "WBL", "QPL"]

The folder has one study's folder a layout (and world, where there are several), and above them
the tables of all: trials.csv, table.csv and table.json.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from msgspec import Meta

from app.errors import ConfigError
from app.report import Check, Report
from app.studies.check import check_study
from app.studies.experiment import experiment_of
from app.studies.folder import KEYS, Folder, replace, table, trial_rows
from app.studies.study import Part, Study, tell
from app.toml import Name, Table, read_toml

Several = Annotated[tuple[Name, ...], Meta(min_length=1)]


class MatrixTable(Table, frozen=True, kw_only=True):
    """What is tried; what is left out is the experiment's own.

    layouts: names or paths of sensor layouts.   worlds: error budgets, as --world.
    trials:  of each cell, with seeds from `seed` on.   seconds, rate: of each trial [s], [Hz].
    """

    experiment: Name
    layouts: Several
    conditions: tuple[Name, ...] = ()
    worlds: Several = ("honest",)
    trials: Annotated[int, Meta(ge=1)] | None = None
    seed: Annotated[int, Meta(ge=0)] = 0
    seconds: Annotated[float, Meta(ge=0.1, lt=1e6)] | None = None
    rate: Annotated[float, Meta(ge=50.0, le=500.0)] = 125.0


class Cell(NamedTuple):
    """A layout in a world: the name of its folder, and its study."""

    name: str
    study: Study


def read_matrix(path: Path) -> list[Cell]:
    """The studies of a file; FlinchError in one line for one that cannot be run."""
    m = read_toml(path, MatrixTable, ConfigError)
    experiment_of(m.experiment)
    cells = []
    for layout in m.layouts:
        for world in m.worlds:
            name = Path(layout).stem + (f" {world}" if len(m.worlds) > 1 else "")
            study = Study(
                m.experiment, m.conditions, m.trials, m.seconds, m.seed, world, m.rate,
                layout,
            )  # fmt: skip
            cells.append(Cell(re.sub(r"[^\w.=-]+", "_", name), study))
    names = [c.name for c in cells]
    if twice := sorted({n for n in names if names.count(n) > 1}):
        raise ConfigError(f"{path}: {', '.join(twice)} there twice; name each cell once")
    for cell in cells:
        check_study(cell.study)
    return cells


@contextmanager
def opened(cells: Sequence[Cell], out: Path, shard: str) -> Iterator[list[Part]]:
    """The studies with their logs in their folders, which no other process writes meanwhile."""
    with ExitStack() as stack:
        parts = []
        for cell in cells:
            folder = Folder(out / cell.name)
            stack.enter_context(folder.writing(shard))
            folder.begin(cell.study)
            parts.append(folder.part(cell.study, shard))
        yield parts


def tell_matrix(cells: Sequence[Cell], out: Path, shard: str) -> Report:
    """Write and give the table with one row a layout and condition, and each cell's own."""
    rows, trials, checks = list[dict[str, Any]](), list[dict[str, Any]](), list[Check]()
    for cell in cells:
        folder = Folder(out / cell.name)
        results = folder.part(cell.study, shard).results()
        report = tell(cell.study, results)
        folder.write(cell.study, results, report)
        where = {"layout": cell.study.skin, "world": cell.study.world}
        rows += [_row(cell, where, row) for row in report.rows if _wanted(cell.study, row)]
        trials += [where | row for row in trial_rows(cell.study, results)]
        checks += [
            Check(f"{cell.name}: {c.name}", c.value, c.unit, c.limit, c.at_least)
            for c in report.checks
        ]
    report = Report(f"matrix of {cells[0].study.experiment}", cells[0].study.seed, rows, checks)
    replace(out / "trials.csv", table(trials, ("layout", "world", *KEYS)))
    replace(out / "table.csv", table(rows, ("name",)))
    replace(out / "table.json", report.to_json() + "\n")
    return report


def _row(cell: Cell, where: dict[str, Any], row: dict[str, Any]) -> dict[str, Any]:
    rest = {k: v for k, v in row.items() if k != "name"}
    return {"name": f"{cell.name} {row['name']}", **where, "condition": row["name"], **rest}


def _wanted(study: Study, row: dict[str, Any]) -> bool:
    """Is it of a condition that was asked for, and no comparison within a cell?"""
    return row["name"] in experiment_of(study.experiment).wanted(study.conditions)
