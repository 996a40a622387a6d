"""`flinch coverage`: what the skin sees of what comes to the arm, and what it cannot see."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from app.cli.seed import Seed
from app.cli.which import WhichRobot
from app.errors import ConfigError


@dataclass(frozen=True)
class Coverage(WhichRobot):
    """Where a skin sees what comes to the arm, link by link, before it touches; what the loss of
    each sensor costs; the space round the arm that nobody watches."""

    postures: str = "home"
    """Which postures: home, grid:N all over the workspace, program:NAME, recording:FILE.mcap."""
    out: Path | None = None
    """Folder for coverage.json, patches.csv, coverage.png and coverage.html."""
    patches: int = 5000
    """Number of patches of the arm's surface."""
    radius: float = 0.05
    """Radius of what comes [m]: 0.05 a hand, 0.1 an arm."""
    speed: float = 1.0
    """How fast it comes [m/s], for the time to contact."""
    reach: float = 0.0
    """How far sensors are counted on [m]; 0: as far as their type finds a grey target."""
    check: int = 0
    """Throw so many spheres before the simulated sensors, at the last posture, and compare."""
    seed: Seed = 0
    """Seed of the throws."""
    jobs: int = 1
    """Number of processes that look at postures."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if self.patches < 100 or min(self.radius, self.speed) <= 0.0:
            raise ConfigError("give 100 patches or more, and a positive radius and speed")
        if min(self.reach, self.check) < 0 or self.jobs < 1:
            raise ConfigError("reach and check cannot be negative, and jobs must be positive")
        if self.out is not None:
            from app.plot import check_matplotlib

            check_matplotlib("--out")

    def __call__(self) -> None:
        from app.studies.coverage.portions import Plan, subject_for
        from app.studies.coverage.postures import postures_of
        from app.studies.coverage.study import cover, warnings

        plan = Plan(self.setup(), self.patches, self.radius, self.speed, self.reach or None)
        subject = subject_for(plan)
        robot, skin = subject.robot, subject.skin
        q = postures_of(self.postures, robot)
        told = warnings(subject)
        for words in told:
            print(f"flinch: {words}", file=sys.stderr)
        what = f"coverage of {robot.name} by {skin.title!r}, {len(q)} postures ({self.postures})"
        with shown("coverage", len(q) + self.check) as done:
            found = cover(plan, q, what, self.check, self.seed, self.jobs, done)
        if self.out is not None:
            from app.page import write_sheet
            from app.studies.coverage.pictures import draw
            from app.studies.coverage.sheet import page
            from app.studies.coverage.study import write_patches
            from app.studies.folder import Folder

            folder = Folder(self.out).path
            write_patches(found.tally, folder / "patches.csv")
            draw(found, folder / "coverage.png")
            write_sheet(folder / "coverage.html", page(found, folder / "coverage.png", told))
            write_sheet(folder / "coverage.json", found.report.to_json())
        print(found.report.to_json() if self.json else found.report.to_text())


@contextmanager
def shown(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """A bar on a terminal; what is called is to be told how many steps are done."""
    from rich.console import Console
    from rich.progress import Progress

    quiet = not sys.stderr.isatty()
    with Progress(console=Console(stderr=True), transient=True, disable=quiet) as bars:
        task = bars.add_task(what, total=total)
        yield lambda steps: bars.advance(task, steps)
