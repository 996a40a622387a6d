"""`flinch place`: where a number of sensors sees most of what comes to the arm."""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.coverage import shown
from app.cli.which import WhichRobot
from app.errors import ConfigError

if TYPE_CHECKING:
    from app.report import Report
    from app.studies.coverage.placement import Wanted


@dataclass(frozen=True)
class PlaceCommand(WhichRobot):
    """Place rings of sensors, with covers to print, where they see most of what comes to the arm;
    write a layout that `flinch run --skin` takes."""

    sensors: int = 30
    """Number of sensors, at most."""
    sweep: tuple[int, ...] = ()
    """Several numbers of sensors instead; taken is the knee: the fewest that are worth 95 % of the
    most."""
    out: Path = Path("placed")
    """Folder for layout.toml, the covers' STL files to print, place.json and place.png."""
    type: str = "vl53l8cx"
    """Type of the sensors: a name in static_assets/sensors, or a file."""
    links: str = ""
    """Links that may wear some, separated by commas; every round one where left out."""
    keep_out: tuple[str, ...] = ()
    """Where nothing may go: LINK, or LINK:FROM:TO, metres along its round part from its joint."""
    counts: tuple[int, ...] = (4, 5, 6, 8, 10)
    """Numbers of sensors that a ring may have."""
    tilts: tuple[float, ...] = (-35.0, 0.0, 35.0)
    """How far a ring's sensors may look along the link [degrees]."""
    ports: int = 1
    """Number of serial ports that carry them."""
    baud: int = 2_000_000
    """Speed of each of these."""
    postures: str = "grid:32"
    """Which postures: grid:N all over the workspace, program:NAME, recording:FILE.mcap. Every
    second one is kept to look at what was chosen."""
    horizon: float = 0.4
    """At which distance it is soon enough to see something [m]."""
    worlds: int = 0
    """Close the loop: run the arm in so many random worlds with each layout, and with its own."""
    seed: int = 0
    """Seed of the first world."""
    jobs: int = 1
    """Number of processes."""
    engine: str = "local"
    """Where the worlds' trials run; see `flinch experiment worlds`."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if min(self.numbers) < 1 or self.worlds < 0 or min(self.jobs, self.ports, self.baud) < 1:
            raise ConfigError("sensors, jobs, ports and baud must be positive")
        if not self.counts or min(self.counts) < 1 or not self.tilts:
            raise ConfigError("give one count and one tilt of rings at least")
        if self.postures in ("home", "grid:1"):  # one is chosen on, another looked at
            raise ConfigError(f"postures = {self.postures!r} is one posture; give grid:2 or more")
        if not 0.05 <= self.horizon <= 1.5 or not all(abs(t) < 90.0 for t in self.tilts):
            raise ConfigError("the horizon lies between 0.05 and 1.5 m, tilts between -90 and 90")

    @property
    def numbers(self) -> tuple[int, ...]:
        """Of sensors, that are placed."""
        return self.sweep or (self.sensors,)

    def __call__(self) -> None:
        from app.plot import check_matplotlib
        from app.studies.coverage.placement import candidates_for
        from app.studies.coverage.postures import postures_of
        from app.studies.coverage.trying import (
            Trying,
            draw_curve,
            knee,
            looked_at,
            placed_layouts,
            report_of,
        )
        from app.studies.folder import Folder

        check_matplotlib("place")
        own, wanted = self.setup(), self._wanted()
        trying = Trying(self.worlds, self.seed, self.engine, self.jobs)
        trying.check(own)
        folder = Folder(self.out).path
        q = postures_of(self.postures, candidates_for(wanted).robot)
        with shown("postures", len(q[::2])) as done:
            placed = placed_layouts(
                wanted, self.numbers, q[::2], folder, self.jobs, lambda: done(1)
            )
        layouts = looked_at(wanted, own, placed, q[1::2], trying)
        draw_curve(layouts, folder / "place.png")
        self._write(Path(knee(layouts).skin), folder, report_of(wanted, layouts, self.seed))

    def _wanted(self) -> "Wanted":
        from app.coverage.sites import parse_keep_out
        from app.studies.coverage.placement import Wanted

        return Wanted(
            setup=replace(self.setup(), skin="none"), sensors=max(self.numbers), kind=self.type,
            links=tuple(filter(None, self.links.split(","))),
            keep_out=tuple(map(parse_keep_out, self.keep_out)), counts=self.counts,
            tilts=self.tilts, ports=self.ports, baud=self.baud, horizon=self.horizon,
        )  # fmt: skip

    def _write(self, layout: Path, folder: Path, report: "Report") -> None:
        from app.choices import build_robot
        from app.page import write_sheet
        from app.robot.cover_print import write_prints

        final = folder / "layout.toml"
        write_sheet(final, layout.read_text("utf-8"))
        prints = write_prints(final, build_robot(replace(self.setup(), skin="none")), folder)
        write_sheet(folder / "place.json", report.to_json())
        print(report.to_json() if self.json else report.to_text())
        print(f"{final} and {len(prints)} covers: flinch run --skin {final}", file=sys.stderr)
