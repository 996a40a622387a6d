"""`flinch run`: the arm with its page, or headless."""

import os
import signal
import sys
import threading
import webbrowser
from contextlib import ExitStack
from dataclasses import dataclass, field, fields, make_dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, TextIO

import tyro

from app.cli.confirm import confirm
from app.cli.desktop import has_desktop
from app.cli.interrupt import end_at_once, end_in_order
from app.cli.kernels import print_progress
from app.cli.seed import Seed
from app.cli.which import WhichRobot
from app.config import Params, load_params, tunables
from app.control.guests.files import welcome
from app.control.registry import kinds
from app.errors import ConfigError, RecordingError
from app.timing import WallClock
from app.ui.entrance import Entrance, checked_origin, operator_token
from app.ui.live.window import VIEWERS_PORT, Window, viewer_origin

if TYPE_CHECKING:  # the parts of an engine take a second to load; --help need not wait for it
    from app.record.recorder import Recorder
    from app.runtime import Engine
    from app.setup import Setup

DEFAULT_PORT = 8080


def no_flags() -> Any:
    """One optional flag for every setting, none of them given, from the facts in `app.config`.

    Made when a command line is read: who registers a controller before that finds it there.
    """
    kinds()  # the controllers there are
    made: list[tuple[str, Any, Any]] = []
    for t in tunables():
        kind: Any = Literal[t.choices] if t.choices else t.kind
        unit = f" [{t.unit}, {t.low:g} to {t.high:g}]" if t.low is not None else ""
        text = f"{t.help}{unit.replace('[, ', '[')}; default {t.default}"
        made.append((t.name, Annotated[kind | None, tyro.conf.arg(help=text)], None))
    return make_dataclass("ParamFlags", made, frozen=True)()


@dataclass(frozen=True)
class Run(WhichRobot):
    """Run the arm: with its page in a browser, or headless for a number of seconds."""

    scene: str = "first"
    """A scene's name, or the path of its TOML file; 'cell' has a person who works there."""
    person: str = ""
    """Who is there instead of the scene's people: 'none', or 'bvh:FILE[@X,Y[,HEADING]]', a motion
    file played again and again from a place on [m, degrees]; default: where the scene's first
    person begins."""
    cell: str = ""
    """The known static place (boxes, planes, what was learned): a cell's or a scene's name, or the
    path of its TOML file; default: the scene's, which is nobody's real place. Points in it are no
    obstacles, and the arm keeps out of it. What is learned on the page is kept in your own file."""
    sensors: str = "simulated"
    """'simulated'; 'replay:PATH[@SENSOR]' (frames of a state_ToF.csv, 8x8 or 4x4; several separated
    by commas, or a folder of folders that bear sensors' names; or a file of record-skin); or
    'serial:PORT[@BAUD][#FORMAT][=SENSORS][:latency_ms=MS]', several ports separated by commas,
    'serial:auto' to look for them (formats binary, f, table, lines, the last two also with -plain
    where columns are printed from the left; SENSORS is a sensor's or a ring's name, needed where
    the format names none; MS from a measurement's middle to its arrival, or to its board's stamp,
    estimated where it is left out). '+simulated' after the last two simulates the sensors that are
    left."""
    driver: str = "simulated"
    """'simulated' or 'ur:HOST': a UR on the network, only watched without --arm."""
    arm: bool = False
    """Let commands move the real arm; asks at the console first."""
    program: str = ""
    """A waypoint program to follow: a name, or the path of its TOML file."""
    controller: str = ""
    """Another's controller leads the simulated arm: FILE.py, or FILE.py:CLASS (see benchmark)."""
    ghost: str = ""
    """A second controller, by its mode, on a translucent arm of its own, for comparison."""
    rate: float = 250.0
    """Ticks a second, 50 to 500."""
    seed: Seed = 0
    """Seed of the sensors' noise and of the people's habits."""
    background: Path | None = None
    """Keep what is learned of the cell in this file and not in the cell's own."""
    ranges: Path | None = None
    """Table of each zone's range error, from `flinch calibrate ranges`."""
    mounts: Path | None = None
    """Where the sensors really sit, from `flinch calibrate mounts`."""
    world: str = "honest"
    """How far the simulated truth is from what is believed: 'honest' (the error budget of a skin
    that was glued on by hand, drawn with the seed) or 'ideal', then single parts with a strength:
    'honest,mounting=0' or 'ideal,mounting=1,late_ms=30'. Parts: mounting, encoders, kinematics,
    time, late_ms, zones, sub, reflectance, ranges, light, cover, body."""
    stray: float = 0.0
    """Share of the simulated zones and frames that report something where nothing is."""
    port: int = DEFAULT_PORT
    """Port of the page; 0 takes a free one."""
    host: str = "127.0.0.1"
    """Address that the page listens on; beyond this machine it takes an operator token."""
    token_file: Path | None = None
    """A file with the operator token; the variable FLINCH_TOKEN can hold it instead."""
    origin: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """A public address of the page, as of a proxy in front: https://cell.example; may be given
    several times."""
    foxglove: tuple[int, ...] | None = None
    """Show the run to Foxglove or Lichtblick as well, at ws://localhost:PORT (8765 without one):
    read only, from this machine only."""
    foxglove_origin: tuple[str, ...] = ()
    """Web pages that may look there: https://app.foxglove.dev. Desktop viewers need none."""
    open: bool = True
    """Open the page in a browser where there is a desktop."""
    headless: bool = False
    """No page: run faster than real time and print a summary."""
    seconds: float = 10.0
    """Length of a headless run [s]."""
    json: bool = False
    """Print the headless summary as one JSON object."""
    record: Path | None = None
    """Record the run into this new file, FILE.mcap: all that enters every tick, to be replayed."""
    recordings: Path = Path("recordings")
    """Folder of what is recorded from the page; made when it is needed."""
    config: Annotated[Path | None, tyro.conf.arg(aliases=["--params"])] = None
    """A TOML file of settings, as the page saves them; flags win over it."""
    settings: Annotated[Any, tyro.conf.OmitArgPrefixes] = field(default_factory=no_flags)

    def __post_init__(self) -> None:
        if not 0.0 < self.seconds < 1e6:
            raise ConfigError(f"seconds = {self.seconds:g}; give a positive number")
        if not 0.0 <= self.stray <= 0.1:
            raise ConfigError(f"stray = {self.stray:g}; give a share from 0 to 0.1")
        for port in (self.port, *(self.foxglove or ())):
            if not 0 <= port < 65536:
                raise ConfigError(f"port = {port}; give a value from 0 to 65535")
        if self.foxglove is not None and len(self.foxglove) > 1:
            raise ConfigError(f"foxglove = {self.foxglove}; give one port, or none for 8765")
        if self.foxglove_origin and self.foxglove is None:
            raise ConfigError("--foxglove-origin belongs to live viewers; add --foxglove")

    def __call__(self) -> None:
        from app.setup import SIMULATED

        end_at_once()
        params = load_params(self.config) if self.config else Params()
        given = {f.name: getattr(self.settings, f.name) for f in fields(self.settings)}
        params = replace(params, **{k: v for k, v in given.items() if v is not None})
        if self.controller:
            if self.driver != SIMULATED:
                raise ConfigError("--controller leads a simulated arm; leave it or --driver out")
            params = replace(params, mode=welcome(self.controller))
        setup = self.setup(
            scene=self.scene, person=self.person, cell=self.cell, sensors=self.sensors,
            rate=self.rate, seed=self.seed, stray=self.stray, program=self.program,
            ghost=self.ghost, background=self.background, ranges=self.ranges,
            mounts=self.mounts, world=self.world,
            driver=self.driver, armed=self.arm,
        )  # fmt: skip
        if self.headless:
            if self.driver != SIMULATED:
                raise ConfigError(
                    "a headless run is faster than real time; leave --headless or --driver out"
                )
            if self.foxglove is not None:
                raise ConfigError("--foxglove shows a run as it happens; leave --headless out")
            self._headless(setup, params)
        else:
            if self.json:
                raise ConfigError("--json belongs to a headless run; add --headless")
            entrance = self._entrance()
            if self.arm:
                confirm(self.driver, self.sensors)
            _serve(setup, params, entrance, self._window(), self.open, self._files())

    def _headless(self, setup: "Setup", params: Params) -> None:
        """Run without a page, record where that is asked for, and print what came of it."""
        from app.record.recorder import start_recording
        from app.sources import clock_for
        from app.studies.headless import summary

        recorders: list[Recorder] = []

        def ready(engine: "Engine") -> None:
            end_in_order()
            if self.record is not None:
                in_real_time = isinstance(clock_for(setup), WallClock)
                recorders.append(start_recording(engine, setup, self.record, in_real_time))

        report = summary(setup, self.seconds, params, ready)
        print(report.to_json() if self.json else report.to_text())
        _say_recorded(recorders, sys.stderr if self.json else sys.stdout)

    def _files(self) -> "Files":
        return Files(self.record, self.recordings)

    def _window(self) -> Window | None:
        """Where other viewers look in, if they may."""
        if self.foxglove is None:
            return None
        return Window(
            self.foxglove[0] if self.foxglove else VIEWERS_PORT,
            tuple(map(viewer_origin, self.foxglove_origin)),
        )

    def _entrance(self) -> Entrance:
        origins = tuple(map(checked_origin, self.origin))
        token = operator_token(self.host, origins, self.token_file, os.environ)
        return Entrance(self.host, self.port, token, origins)


class Files(NamedTuple):
    """Where recordings go: this run's from its start, if it is; and those of the page."""

    record: Path | None
    folder: Path


def _say_recorded(recorders: "list[Recorder]", out: TextIO) -> None:
    """Print what is in the file, if there is one; RecordingError if it has ended before the run."""
    for p in (r.state for r in recorders):
        if p.fault:
            raise RecordingError(f"{p.fault}; {p.seconds:.1f} s of the run are in it")
        lost = f", {p.dropped} dropped" if p.dropped else ""
        words = f"recorded {p.seconds:.1f} s, {p.ticks} ticks{lost}, in {p.path}"
        print(words, file=out, flush=True)


def _serve(
    setup: "Setup", params: Params, entrance: Entrance, window: Window | None, open_browser: bool,
    files: Files,
) -> None:  # fmt: skip
    """Engine, page and, with a window, live views until the process is asked to end."""
    from app.record.recorder import start_recording
    from app.record.ring import Ring
    from app.ui.desk import Desk
    from app.ui.live.server import LiveViews
    from app.ui.page import Page
    from app.wiring import build_engine

    quit_asked = threading.Event()
    host, port, token, origins = entrance
    with ExitStack() as ends:  # in the other order: what shows the engine goes before it
        recorders: list[Recorder] = []
        ends.callback(_say_recorded, recorders, sys.stdout)
        setup = replace(setup, apart=True)
        engine = build_engine(setup, WallClock(), params)
        ends.callback(engine.close)
        end_in_order()
        if files.record is not None:
            recorders.append(start_recording(engine, setup, files.record))
        ring = Ring(engine, setup)
        engine.follow(ring)
        desk = Desk(engine, setup, files.folder, ring, *recorders)
        page = Page(engine, host, port, token=token, origins=origins, desk=desk)
        ends.callback(page.stop)
        live = LiveViews(engine, window.port, window.origins) if window else None
        if live:
            ends.callback(live.stop)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: quit_asked.set())
        engine.progress = print_progress
        engine.start()
        page.start()
        print(f"Flinch is at {page.url}  (Ctrl-C ends it)", flush=True)
        if live:
            live.start()
            print(f"Foxglove and Lichtblick see it at {live.url}", flush=True)
        for line in (*entrance.words(), *engine.warnings):
            print(line, flush=True)
        if open_browser and has_desktop():
            webbrowser.open(page.url)
        quit_asked.wait()
