"""The front door: run, bench tick, doctor. Wires rooms, decides nothing."""

import logging
import os
import signal
import sys
import threading
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, make_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from app.config import Params, load_params, tunables
from app.errors import ConfigError, FlinchError
from app.robot.meshes import Bodies
from app.robot.tables import Choice
from app.timing import WallClock
from app.wiring import Setup, build_engine, build_robot, choose_skin

DEFAULT_PORT = 8080


def _flags_of_params() -> type:
    """One optional flag for every setting, made from the facts in `app.config`."""
    made: list[tuple[str, Any, Any]] = []
    for t in tunables():
        kind: Any = Literal[t.choices] if t.choices else t.kind
        unit = f" [{t.unit}, {t.low:g} to {t.high:g}]" if t.low is not None else ""
        text = f"{t.help}{unit.replace('[, ', '[')}; default {t.default}"
        made.append((t.name, Annotated[kind | None, tyro.conf.arg(help=text)], None))
    return make_dataclass("ParamFlags", made, frozen=True)


ParamFlags = _flags_of_params()


@dataclass(frozen=True)
class WhichRobot:
    """The flags that choose a robot; every command that takes one has the same."""

    robot: str = "ur10e"
    """A robot's name, the path of its folder, or robot_descriptions:NAME."""
    urdf: str = ""
    """A bare URDF file instead, with its own meshes; give it a --skin."""
    tool: str = ""
    """A tool of the robot, a tool's TOML file, a link of the URDF as tool frame, or 'none'."""
    home_deg: tuple[float, ...] = ()
    """Posture to begin in [degrees, mm for a sliding joint], one value a joint."""
    bodies: Bodies = "collision"
    """Meshes of the URDF that distances are measured to."""

    def choice(self) -> Choice:
        """What was chosen beside the robot itself."""
        return Choice(self.tool, self.home_deg, self.bodies)


@dataclass(frozen=True)
class Run(WhichRobot):
    """Run the arm: with its page in a browser, or headless for a number of seconds."""

    skin: str = ""
    """A sensor layout's name or path; default: the robot's own."""
    scene: str = "cell"
    """A scene's name, or the path of its TOML file."""
    sensors: str = "simulated"
    """'simulated' or 'replay:PATH[@SENSOR]' (recorded 8x8 frames on one sensor)."""
    program: str = ""
    """A waypoint program to follow: a name, or the path of its TOML file."""
    ghost: str = ""
    """A second controller (wb, sm, multi, qp) on a translucent arm of its own, for comparison."""
    rate: float = 250.0
    """Ticks a second, 50 to 500."""
    seed: int = 0
    """Seed of the sensors' noise and of the people's habits."""
    background: Path | None = None
    """File of the learned background: read at the start, written when one is learned."""
    stray: float = 0.0
    """Share of the simulated zones and frames that report something where nothing is."""
    port: int = DEFAULT_PORT
    """Port of the page on 127.0.0.1; 0 takes a free one."""
    open: bool = True
    """Open the page in a browser where there is a desktop."""
    headless: bool = False
    """No page: run faster than real time and print a summary."""
    seconds: float = 10.0
    """Length of a headless run [s]."""
    json: bool = False
    """Print the headless summary as one JSON object."""
    config: Path | None = None
    """A TOML file of settings; flags win over it."""
    settings: Annotated[Any, tyro.conf.OmitArgPrefixes] = field(default_factory=ParamFlags)

    def __post_init__(self) -> None:
        if not 0.0 < self.seconds < 1e6:
            raise ConfigError(f"seconds = {self.seconds:g}; give a positive number")
        if not 0.0 <= self.stray <= 0.1:
            raise ConfigError(f"stray = {self.stray:g}; give a share from 0 to 0.1")
        if not 0 <= self.port < 65536:
            raise ConfigError(f"port = {self.port}; give a value from 0 to 65535")

    def __call__(self) -> None:
        params = load_params(self.config) if self.config else Params()
        given = {f.name: getattr(self.settings, f.name) for f in fields(self.settings)}
        params = replace(params, **{k: v for k, v in given.items() if v is not None})
        setup = Setup(
            self.robot, self.skin, self.scene, self.sensors, self.rate, self.seed,
            urdf=self.urdf, choice=self.choice(),
            stray=self.stray, program=self.program, ghost=self.ghost,
            background=self.background,
        )  # fmt: skip
        if self.headless:
            from app.studies.headless import summary

            report = summary(setup, self.seconds, params)
            print(report.to_json() if self.json else report.to_text())
        else:
            if self.json:
                raise ConfigError("--json belongs to a headless run; add --headless")
            _serve(setup, params, self.port, self.open)


@dataclass(frozen=True)
class Bench:
    """Measure: `tick` each room of a tick and its lateness, `perception`, or its `peers`;
    `control` the step from pairs to velocity, beside other software where it is installed."""

    what: tyro.conf.Positional[Literal["tick", "perception", "peers", "control"]]
    robot: str = "ur10e"
    """A robot's name, or the path of its folder."""
    scene: str = "cell"
    """A scene's name, or the path of its TOML file."""
    rate: float = 250.0
    """Ticks a second, 50 to 500."""
    seconds: float = 5.0
    """Length of each measurement [s]."""
    seed: int = 0
    """Seed of the sensors' noise and of the people's habits."""
    urdf: Path | None = None
    """Perception and peers: a UR10e description whose visual meshes are tried as bodies, too."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        if self.what == "control":
            from app.studies.bench_control import bench_control

            report = bench_control(steps=int(400 * self.seconds), seed=self.seed)
        elif self.what == "tick":
            from app.studies.bench_tick import bench_tick

            setup = Setup(robot=self.robot, scene=self.scene, rate=self.rate, seed=self.seed)
            report = bench_tick(setup, self.seconds)
        elif self.what == "perception":
            from app.studies.bench_perception import bench_perception

            report = bench_perception(self.seed, urdf=self.urdf)
        else:
            from app.studies.bench_peers import bench_peers

            report = bench_peers(self.seed, urdf=self.urdf)
        print(report.to_json() if self.json else report.to_text())


@dataclass(frozen=True)
class CalibrateFilter:
    """Suggest the self filter's threshold of each link from returns of the robot itself."""

    recording: tyro.conf.Positional[str]
    """'simulated', or PATH[@SENSOR]: an arm at rest at home with nothing near it."""
    robot: str = "ur10e"
    """A robot's name, or the path of its folder."""
    skin: str = ""
    """Path of a sensor layout; default: the robot's own."""
    seed: int = 0
    """Seed of a simulated calibration."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.studies.calibrate import calibrate

        report = calibrate(self.robot, self.recording, self.skin, self.seed)
        print(report.to_json() if self.json else report.to_text())


@dataclass(frozen=True)
class SkinCommand:
    """Check a sensor against the layout: convention of its ranges, order of its zones."""

    what: tyro.conf.Positional[Literal["check"]]
    show: Literal["wall", "hand"] = "wall"
    """A flat wall, or a hand that goes from left to right and then from top to bottom."""
    sensors: str = "simulated"
    """'simulated[@SENSOR]' or PATH[@SENSOR] of a recording."""
    robot: str = "ur10e"
    """A robot's name, or the path of its folder."""
    seed: int = 0
    """Seed of the simulated noise."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.studies.skin_check import skin_check

        report = skin_check(self.robot, self.show, self.sensors, self.seed)
        print(report.to_json() if self.json else report.to_text())


@dataclass(frozen=True)
class Doctor(WhichRobot):
    """Examine a robot: inertias, limits, meshes, sensors, self-intersections, frames."""

    robot: tyro.conf.Positional[str] = "ur10e"
    """A robot's name, the path of its folder, or robot_descriptions:NAME."""
    skin: str = ""
    """A sensor layout's name or path; default: the robot's own, if it has one."""
    json: bool = False
    """Print one JSON object."""

    def __call__(self) -> None:
        from app.studies.doctor import examine, to_table

        setup = Setup(self.robot, self.skin, urdf=self.urdf, choice=self.choice())
        robot = build_robot(setup)
        skin = choose_skin(setup, robot) if self.skin or robot.skin else None
        report = examine(robot, skin)
        print(report.to_json() if self.json else to_table(report))


@dataclass(frozen=True)
class Experiment:
    """Run controllers against each other: `worlds` in random worlds, `tradeoff` in the
    paper's scenes over the distance that is kept. Takes minutes; hours with many worlds."""

    what: tyro.conf.Positional[Literal["worlds", "tradeoff"]]
    worlds: int = 30
    """Number of random worlds."""
    seconds: float = 10.0
    """Length of each run [s]."""
    cell_seconds: float = 40.0
    """tradeoff: length of the runs beside the person [s]."""
    seed: int = 0
    """Seed of the first world, of the noise and of the people's habits."""
    json: bool = False
    """Print one JSON object."""

    def __post_init__(self) -> None:
        if self.worlds < 1 or not 0.0 < self.seconds < 1e6 or not 0.0 < self.cell_seconds < 1e6:
            raise ConfigError("worlds, seconds and cell-seconds must be positive")

    def __call__(self) -> None:
        if self.what == "worlds":
            from app.studies.random_worlds import random_worlds

            report = random_worlds(self.worlds, self.seconds, self.seed)
        else:
            from app.studies.tradeoff import tradeoff

            report = tradeoff(seconds=self.seconds, cell_seconds=self.cell_seconds, seed=self.seed)
        print(report.to_json() if self.json else report.to_text())


def main(args: Sequence[str] | None = None) -> int:
    """Entry point; a user's error is one line on standard error and exit code 1."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(name)s: %(message)s")
    app = tyro.extras.SubcommandApp()
    app.command(name="run")(Run)
    app.command(name="bench")(Bench)
    app.command(name="doctor")(Doctor)
    app.command(name="calibrate-filter")(CalibrateFilter)
    app.command(name="skin")(SkinCommand)
    app.command(name="experiment")(Experiment)
    try:
        command = app.cli(args=args, prog="flinch", description="A robot arm that gives way.")
        command()
    except FlinchError as error:
        print(f"flinch: {error}", file=sys.stderr)
        return 1
    return 0


def _serve(setup: Setup, params: Params, port: int, open_browser: bool) -> None:
    """Engine and page until the process is asked to end."""
    from app.ui.page import Page

    engine = build_engine(setup, WallClock(), params)
    page = Page(engine, "127.0.0.1", port)
    quit_asked = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: quit_asked.set())
    try:
        engine.start()
        page.start()
        print(f"Flinch is at {page.url}  (Ctrl-C ends it)", flush=True)
        if open_browser and _has_desktop():
            webbrowser.open(page.url)
        quit_asked.wait()
    finally:
        page.stop()
        engine.stop()


def _has_desktop() -> bool:
    if os.environ.get("CI"):
        return False
    return sys.platform in ("darwin", "win32") or any(
        os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY")
    )


if __name__ == "__main__":
    sys.exit(main())
