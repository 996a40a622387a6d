"""A recorded trial of each controller in each set, of the same seed, to be shown side by side."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from app.errors import FlinchError
from app.record.recorder import start_recording
from app.studies.benchmark.attempt import attempt_of
from app.studies.benchmark.listing import Benchmark, SetTable
from app.studies.benchmark.run import file_name, slug
from app.studies.case import build_case
from app.studies.conditions import ORACLE
from app.studies.headless import step_until

LONGEST = 6.0  # [s] of a clip


def shown(controllers: Sequence[str]) -> list[str]:
    """Whose clips there are: what the oracle perceives is in no recording."""
    return [c for c in controllers if c != ORACLE]


def record_clip(bench: Benchmark, s: SetTable, controller: str, folder: Path) -> Path:
    """The first trial of a controller in a set, from its beginning; as it is if it is there.

    Raises the FlinchError of a case that cannot be built.
    """
    path = folder / f"{slug(s.name)}--{file_name(controller)}.mcap"
    if path.exists():
        return path
    spec = next(iter(bench.specs(s, controller).values()))
    condition, case = attempt_of(spec)
    engine, making = build_case(case, condition), path.with_suffix(".part")
    making.unlink(missing_ok=True)
    try:
        own = case.watch(engine) if case.watch else None  # it may be what acts on the world
        start_recording(engine, case.setup, making, threaded=False, views=False)
    except BaseException:
        engine.close()
        raise
    watchers = () if own is None else (own.update,)
    step_until(engine, min(bench.seconds(s), LONGEST), *watchers)
    return making.rename(path)


def record_clips(
    bench: Benchmark, controllers: Sequence[str], folder: Path
) -> Iterator[tuple[SetTable, list[Path] | str]]:
    """The recordings of each set when they are there, or why there are none."""
    folder.mkdir(parents=True, exist_ok=True)
    for s in bench.sets:
        try:
            yield s, [record_clip(bench, s, c, folder) for c in shown(controllers)]
        except FlinchError as error:
            yield s, str(error)
