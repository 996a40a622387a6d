"""Names into parts: builds an engine from what a person asked for. Decides nothing else."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast, get_args

from app.actions import RunProgram
from app.assets import asset_folder
from app.cell.parts import Cell
from app.config import ControlMode, Params
from app.control.programs import find_program, load_program, shipped_programs
from app.errors import ConfigError, RobotError, SensorError
from app.ghost import Ghost
from app.messages import Array
from app.robot.arm import SimulatedArm
from app.robot.descriptions import PREFIX, find_description
from app.robot.model import Robot, find_robot, load_robot, load_urdf
from app.robot.ranges import complete, load_ranges
from app.robot.skin import Skin, load_skin
from app.robot.tables import AS_IT_IS, Choice
from app.runtime import Arm, Engine
from app.sensing.error_model import ErrorModel
from app.sensing.mixed import MixedSkin
from app.sensing.open_ports import open_skin
from app.sensing.replay import Replay, read_recording
from app.sensing.serial_skin import SerialSkin
from app.sensing.simulated import SimulatedSkin
from app.sensing.source import Source
from app.timing import Clock, ManualClock, WallClock
from app.world.scene import find_scene, load_scene
from app.world.world import World

SIMULATED = "simulated"


@dataclass(frozen=True)
class Setup:
    """What to build, by name; the command line and the tests fill it in."""

    robot: str = "ur10e"
    skin: str = ""  # a layout's name or path; empty: the robot's own
    scene: str = "cell"
    sensors: str = "simulated"  # or replay:PATH[@SENSOR], serial:PORT, each with +simulated
    rate: float = 250.0
    seed: int = 0
    program: str = ""  # a waypoint program's name or path, run from the start
    ghost: str = ""  # a second controller's mode, on a simulated arm of its own
    ideal: bool = False  # sensors without noise, bias and dropout
    urdf: str = ""  # a bare URDF instead of a robot's folder
    choice: Choice = AS_IT_IS  # tool, home posture, meshes to measure to
    background: Path | None = None  # file of the learned background, read and written
    ranges: Path | None = None  # table of the zones' range errors
    stray: float = 0.0  # share of zones and frames with a return from nothing
    driver: str = SIMULATED  # or ur:HOST
    armed: bool = False  # may a real arm be moved? only watched otherwise

    def __post_init__(self) -> None:
        if not 50.0 <= self.rate <= 500.0:
            raise ConfigError(f"rate = {self.rate:g} Hz; give a value from 50 to 500")


def build_engine(setup: Setup, clock: Clock, params: Params | None = None) -> Engine:
    """A ready engine, not yet started; raises a FlinchError before anything has begun."""
    robot = build_robot(setup)
    skin = choose_skin(setup, robot)
    programs = shipped_programs()
    if setup.program:
        own = load_program(find_program(setup.program))
        programs[own.name] = own
    if setup.ghost and setup.sensors != "simulated":
        raise ConfigError("a ghost needs a simulated world; leave --ghost or --sensors out")
    real, mixed, _ = setup.sensors.partition("+simulated")
    kind, _, rest = ("simulated", "", "") if mixed else real.partition(":")
    if kind == "simulated" and not rest:
        scene = load_scene(find_scene(setup.scene), setup.seed)
        world, cell = World(scene.bodies), scene.cell
        errors = ErrorModel(ideal=setup.ideal, ghosts=setup.stray)
        simulated = SimulatedSkin(robot, skin, world, setup.seed, errors)
        source: Source = simulated
        home, goal, title = scene.home, scene.goal, scene.title
        if setup.choice.home_deg or scene.robot not in ("", robot.name):
            home = None  # a posture of another robot means nothing here; its own does
        if mixed:
            source = MixedSkin(_real_source(real, skin, clock), simulated)
    else:
        # real sensors see a real world; drawing a simulated one would mislead
        world, source, cell = World(()), _real_source(real, skin, clock), Cell()
        home, goal, title = None, None, f"{'recorded' if kind == 'replay' else 'real'} world"
    arm: Arm | None = None
    try:
        if home is not None and len(home) != robot.n:
            raise ConfigError(
                f"scene {setup.scene!r}: home_deg has {len(home)} values, {robot.name} has "
                f"{robot.n} joints; choose a scene made for this robot, or give the posture with "
                "--home-deg"
            )
        arm = _arm(setup, robot, home)
        if setup.driver != SIMULATED:
            goal = None  # a real arm stays where it is until a person says where to go
        ghost = None
        if setup.ghost:
            q = arm.state(clock.now()).q
            ghost = Ghost(robot, skin, world, cell, _mode(setup.ghost), q, setup.seed)
        engine = Engine(
            robot, skin, arm, source, world, clock,
            params=params, goal=goal, rate=setup.rate, scene=title, programs=programs,
            background=setup.background, ghost=ghost, cell=cell,
        )  # fmt: skip
    except BaseException:
        source.close()
        if arm is not None:
            arm.close()
        raise
    if setup.program:
        engine.post(RunProgram(own.name))
    return engine


def _arm(setup: Setup, robot: Robot, home: Array | None) -> Arm:
    kind, _, host = setup.driver.partition(":")
    if setup.driver == SIMULATED:
        if setup.armed:
            raise ConfigError("--arm belongs to a real arm; add --driver ur:HOST")
        return SimulatedArm(robot, home)
    if kind != "ur" or not host or ":" in host:
        raise ConfigError(
            f"driver = {setup.driver!r}; give 'simulated' or 'ur:HOST' (a UR's ports are fixed)"
        )
    if setup.choice.home_deg:
        raise ConfigError("a real arm begins where it stands; leave --home-deg or --driver out")
    try:
        from app.robot.ur.driver import UrArm
    except ImportError as e:
        raise ConfigError(
            f"driver = {setup.driver!r} needs ur-rtde ({e.name} is missing); install flinch[ur]"
        ) from e
    return UrArm(host, robot, armed=setup.armed)


def build_robot(setup: Setup) -> Robot:
    """The robot that a setup names: a folder, a bare URDF, or a public description."""
    if setup.urdf:
        return load_urdf(Path(setup.urdf), setup.choice)
    if setup.robot.startswith(PREFIX):
        return load_urdf(find_description(setup.robot.removeprefix(PREFIX)), setup.choice)
    return load_robot(find_robot(setup.robot), setup.choice)


def choose_skin(setup: Setup, robot: Robot) -> Skin:
    """The layout that a setup names, or the robot's own."""
    skin = load_skin(_skin_file(setup.skin, robot), robot)
    if setup.ranges is None:
        return skin
    return replace(skin, ranges=complete(load_ranges(setup.ranges, skin.count)))


def _mode(name: str) -> ControlMode:
    for mode in get_args(ControlMode):
        if mode == name:
            return cast(ControlMode, mode)
    raise ConfigError(f"ghost = {name!r}; choose one of {', '.join(get_args(ControlMode))}")


def _skin_file(name: str, robot: Robot) -> Path:
    given = name or robot.skin
    if not given:
        raise RobotError(f"{robot.name} names no skin of its own; choose a layout with --skin")
    inside = (robot.folder / given, robot.folder / "skin" / f"{given}.toml")
    for path in (Path(given), *inside, *_of_another(given)):
        if path.is_file():
            return path
    known = ", ".join(sorted(p.stem for p in (robot.folder / "skin").glob("*.toml")))
    raise RobotError(
        f"skin {given!r} is neither a file nor a layout of {robot.name}; known: {known or 'none'}"
    )


def _of_another(given: str) -> tuple[Path, ...]:
    """A layout of another robot's folder, as NAME/LAYOUT."""
    robot, _, layout = given.partition("/")
    folder = asset_folder("robots") / robot / "skin"
    return (folder / f"{layout}.toml",) if layout and folder.is_dir() else ()


def clock_for(setup: Setup) -> Clock:
    """Time for a run without a page: as fast as it goes, but real ports speak in real time."""
    return WallClock() if setup.sensors.startswith("serial:") else ManualClock()


def _real_source(sensors: str, skin: Skin, clock: Clock) -> Replay | SerialSkin:
    kind, _, rest = sensors.partition(":")
    if kind == "replay" and rest:
        return _replay(rest, skin)
    if kind == "serial" and rest:
        return open_skin(rest, skin, clock)
    raise SensorError(
        f"sensors = {sensors!r}; give 'simulated', 'replay:PATH[@SENSOR]' or 'serial:PORT', "
        "the last two also with '+simulated'"
    )


def _replay(what: str, skin: Skin) -> Replay:
    path, _, sensor = what.partition("@")
    k = skin.index(sensor) if sensor else 0
    return Replay(read_recording(Path(path)), skin, k)
