"""The paper's scenes with its controllers and ours, recorded to be shown side by side."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from app.config import Params
from app.record.recorder import start_recording
from app.setup import Setup
from app.sources import clock_for
from app.studies.headless import step_until
from app.wiring import build_engine

MODES = ("sm", "wb", "qp")


@dataclass(frozen=True)
class PaperScene:
    """name: of the files.   seconds: of simulated time."""

    name: str
    setup: Setup
    seconds: float


SCENES = (
    PaperScene("front-panel", Setup(scene="front-panel"), 8.0),
    PaperScene("side-panel", Setup(scene="side-panel"), 8.0),
    PaperScene("cell", Setup(scene="cell", program="door-screws"), 20.0),
)


def record_scene(scene: PaperScene, folder: Path, share: float = 1.0) -> Iterator[Path]:
    """Record it with each of `MODES`, `share` of its length, into new files; a path when it is
    there. What a file of that name held before is gone."""
    for mode in MODES:
        path = folder / f"{scene.name}-{mode}.mcap"
        path.unlink(missing_ok=True)
        clock = clock_for(scene.setup)
        engine = build_engine(scene.setup, clock, Params(mode=mode))
        start_recording(engine, scene.setup, path, threaded=False, views=False)
        step_until(engine, clock.now() + share * scene.seconds)
        yield path
