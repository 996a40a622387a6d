"""`flinch calibrate mounts`: where the sensors really sit."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import tyro

from app.cli.confirm import confirm
from app.cli.seed import Seed
from app.cli.which import WhichRobot
from app.errors import ConfigError

if TYPE_CHECKING:
    from app.calibration.recording import Recording
    from app.robot.model import Robot
    from app.robot.skin import Skin
    from app.setup import Setup

SIMULATED, LIVE = "simulated", "live"
SLOW = 0.25  # [rad/s] of a real arm unless a person says otherwise


@dataclass(frozen=True)
class CalibrateMounts(WhichRobot):
    """Find where each sensor really sits, its zones' range shares and how late its stamps are,
    from what it sees of the table, the floor, walls or a board, and of the arm itself."""

    source: tyro.conf.Positional[str]
    """'simulated'; 'live', with --sensors and --driver; or the file of a motion (--save)."""
    scene: str = "calibration"
    """What there is to be looked at, true to size: a scene's name, or the path of its TOML file.
    Static boxes and panels are where it says to 1 mm; movable ones are found."""
    out: Path | None = None
    """Write the overlay that `flinch run --mounts FILE` takes."""
    report: Path | None = None
    """Write a page with the residuals before and after."""
    save: Path | None = None
    """Keep the motion in this file, to be fitted again."""
    seconds: float = 300.0
    """Of motion, at most [s]."""
    speed: float | None = None
    """Of the fastest joint [rad/s]; default: 0.6, of a real arm 0.25."""
    sensors: str = SIMULATED
    """live: where the frames come from; see `flinch run --sensors`."""
    driver: str = SIMULATED
    """live: 'simulated' or 'ur:HOST'."""
    arm: bool = False
    """live: move the real arm; asks at the console first."""
    ranges: Path | None = None
    """Table of each zone's range error, from `flinch calibrate ranges`."""
    world: str = "honest"
    """simulated: how far the world is from what is believed; see `flinch run --world`."""
    seed: Seed = 0
    """Seed of the simulation and of the postures."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        real = self.driver != SIMULATED
        if self.source == LIVE and self.sensors == SIMULATED:
            raise ConfigError("live needs --sensors serial:PORT; or give 'simulated'")
        if self.source != LIVE and (self.sensors != SIMULATED or real or self.arm):
            raise ConfigError(
                f"--sensors, --driver and --arm belong to 'live', not {self.source!r}"
            )
        if real and not self.arm:
            raise ConfigError("a real arm has to be moved for this; add --arm")

    def __call__(self) -> None:
        from app.calibration.estimate import estimate_mounts
        from app.calibration.page import write_page
        from app.calibration.planes import planes_of
        from app.calibration.recording import save_recording
        from app.calibration.session import read_scene
        from app.calibration.words import report_of
        from app.choices import build_robot_and_skin
        from app.robot.mounts import save_mounts

        setup = self.setup(
            seed=self.seed, scene=self.scene, cell=self.scene if self.arm else "",
            sensors=self.sensors, driver=self.driver, armed=self.arm, ranges=self.ranges,
            world=self.world,
        )  # fmt: skip
        robot, skin = build_robot_and_skin(setup)
        planes = planes_of(read_scene(setup))
        motion = self._motion(setup, robot, skin)
        if self.save is not None:
            save_recording(self.save, motion)
        found = estimate_mounts(robot, skin, planes, motion)
        if self.out is not None:
            save_mounts(self.out, found.mounts)
        if self.report is not None:
            write_page(self.report, found, f"Mounts of {skin.title}")
        report = report_of(found, self.seed)
        print(report.to_json() if self.json else report.to_text())

    def _motion(self, setup: "Setup", robot: "Robot", skin: "Skin") -> "Recording":
        """From the file, or made now."""
        from app.calibration.recording import load_motion
        from app.calibration.session import Pace, gather
        from app.timing import ManualClock, WallClock

        if self.source not in (SIMULATED, LIVE):
            return load_motion(Path(self.source), robot, skin)
        pace = Pace(self.seconds, self.speed or (SLOW if self.arm else Pace.speed))
        if self.arm:
            confirm(self.driver, self.sensors)
        clock = WallClock() if self.source == LIVE else ManualClock()
        return gather(robot, skin, setup, clock, pace, show_progress)


def show_progress(share: float) -> None:
    """A bar on the terminal; nothing where nobody looks."""
    if sys.stderr.isatty():
        bar = "#" * int(30 * share)
        end = "\n" if share >= 1.0 else ""
        print(f"\r[{bar:<30}] {100 * share:3.0f} %", end=end, file=sys.stderr, flush=True)
