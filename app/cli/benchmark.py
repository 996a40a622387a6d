"""`flinch benchmark`: controllers, ours and others', in the same trials."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from app.errors import ConfigError

if TYPE_CHECKING:
    from app.studies.benchmark.listing import Benchmark as List
    from app.studies.trial import TrialResult

GALLERY = "gallery"


@dataclass(frozen=True)
class Benchmark:
    """Try controllers in a fixed list of trials: contacts, distances, work, smoothness; a table and
    clips side by side. Yours is a file: --controller FILE.py[:CLASS] (the README shows one)."""

    controller: str = ""
    """Your own, beside the others: FILE.py, or FILE.py:CLASS where it has several; commas between
    several files. Shipped: potential_field.py, pink_spheres.py."""
    controllers: str = "qp,wb,sm,paper,oracle"
    """The others, by their modes; oracle: the default one that perceives the truth."""
    quick: bool = False
    """Only a few short sets and seeds: about a minute a controller."""
    sets: str = ""
    """Only these sets, by their names in the list, commas between."""
    seeds: int | None = None
    """So many seeds of each set, not as many as the list says."""
    list: Path | None = None
    """Another list than the shipped one."""
    out: Path | None = None
    """A folder for all that comes of it: trials, which are not run again, benchmark.md, .csv and
    .json, index.html and the gallery."""
    clips: bool = True
    """With --out: record a short trial of every controller in every set, shown side by side."""
    jobs: int = 1
    """Number of processes."""
    json: bool = False
    """Print one JSON object instead of Markdown."""

    def __post_init__(self) -> None:
        if self.jobs < 1 or (self.seeds is not None and self.seeds < 1):
            raise ConfigError("jobs and seeds must be positive")

    def __call__(self) -> None:
        from app.studies.benchmark.listing import only_sets, read_list
        from app.studies.benchmark.run import run_benchmark
        from app.studies.benchmark.table import faults_of, rows_of
        from app.studies.benchmark.write import as_json, markdown, write_tables
        from app.studies.study import locally

        asked = f"{self.controller},{self.controllers}".split(",")
        controllers = tuple(dict.fromkeys(c.strip() for c in asked if c.strip()))
        if not controllers:
            raise ConfigError("no controller; give --controllers qp or --controller FILE.py")
        bench = read_list(self.list, self.quick, self.seeds)
        if self.sets:
            names = [n.strip() for n in self.sets.split(",")]
            bench = only_sets(bench, names)
        folder = None if self.out is None else self.out / "trials"
        outcomes = run_benchmark(bench, controllers, locally(self.jobs), folder, _told)
        rows, faults = rows_of(outcomes, bench.table.distance_kept_m), faults_of(outcomes)
        if self.out is not None:
            write_tables(self.out, bench.title, rows, faults)
            if self.clips and _gallery(bench, controllers, self.out):
                write_tables(self.out, bench.title, rows, faults, f"{GALLERY}/index.html")
        tell = as_json if self.json else markdown
        print(tell(bench.title, rows, faults))


def _told(result: "TrialResult", done: int, wanted: int) -> None:
    """A line for each trial that is done, beside the table."""
    words = result.fault or f"least {result.figures['true_least_m']:.3f} m"
    print(f"{done}/{wanted}  {result.mode}  seed {result.seed}  {words}", file=sys.stderr)


def _gallery(bench: "List", controllers: Sequence[str], out: Path) -> bool:
    """Write the clips of every set as pages; False where there is none."""
    from app.cli.export import write
    from app.studies.benchmark.clips import record_clips
    from app.studies.benchmark.run import slug
    from app.ui.export.export import Part
    from app.ui.export.gallery import write_index
    from app.ui.export.recorded import page_from

    folder, count = out / GALLERY, 0
    folder.mkdir(parents=True, exist_ok=True)
    for s, paths in record_clips(bench, controllers, out / "clips"):
        if isinstance(paths, str):
            print(f"no clip of {s.name!r}: {paths}", file=sys.stderr)
            continue
        if not paths:
            continue
        page = page_from(paths, Part())
        path = folder / f"{slug(s.name)}.html"
        write(page, path)
        count += 1
    if count:
        write_index(folder)
    return count > 0
