"""Names into parts: builds an engine from what a person asked for. Decides nothing else."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from app.actions import RunProgram
from app.brain import Brain
from app.cell.files import load_cell
from app.cell.parts import Cell
from app.config import Params
from app.control.beginning import warnings
from app.control.programs import Program, find_program, load_program, shipped_programs
from app.control.registry import kind_of
from app.errors import ConfigError, RobotError, SensorError
from app.ghost import Ghost
from app.keeper import Keeper
from app.messages import Array, Goal, Mode, freeze
from app.perception.perceiver import Perceiver
from app.plant.mixed import MixedPlant
from app.plant.plant import Arm
from app.plant.real import RealPlant
from app.plant.simulated import SimulatedPlant
from app.robot.arm import SimulatedArm
from app.robot.blind import blind_words
from app.robot.descriptions import PREFIX, find_description
from app.robot.model import Robot, find_robot, load_robot, load_urdf
from app.robot.mounts import load_mounts, with_mounts
from app.robot.ranges import complete, load_ranges
from app.robot.skin import Skin
from app.robot.skin_file import load_skin
from app.robot.tables import AS_IT_IS, Choice
from app.runtime import Engine
from app.sensing.budget import read_budget
from app.sensing.error_model import ErrorModel
from app.sensing.latency import with_stamp_doubt
from app.sensing.mixed import MixedSkin
from app.sensing.open_ports import open_skin
from app.sensing.replay import Replay, read_recording
from app.sensing.serial_skin import SerialSkin
from app.sensing.simulated import SimulatedSkin
from app.sensing.simulated_apart import SimulatedSkinApart
from app.sensing.source import Source
from app.tick import Limits
from app.timing import Clock, ManualClock, WallClock
from app.world.cells import find_cell, is_scene, read_cell
from app.world.scene import Scene, find_scene, load_scene
from app.world.world import World

SIMULATED = "simulated"
SimulatedEyes = SimulatedSkin | SimulatedSkinApart | MixedSkin
PICTURE = 1.0 / 60.0  # [s] a page shows no more of the world than this


@dataclass(frozen=True)
class Setup:
    """What to build, by name; the command line and the tests fill it in."""

    robot: str = "ur10e"
    skin: str = ""  # a layout's name or path; empty: the robot's own
    scene: str = "cell"
    cell: str = ""  # the known static place, by name or path; empty: the scene's
    sensors: str = "simulated"  # or replay:PATH[@SENSOR], serial:PORT, each with +simulated
    rate: float = 250.0
    seed: int = 0
    program: str = ""  # a waypoint program's name or path, run from the start
    ghost: str = ""  # a second controller's mode, on a simulated arm of its own
    urdf: str = ""  # a bare URDF instead of a robot's folder
    choice: Choice = AS_IT_IS  # tool, home posture, meshes to measure to
    background: Path | None = None  # file of the learned background, read and written
    ranges: Path | None = None  # table of the zones' range errors
    mounts: Path | None = None  # overlay on the layout: where the sensors really sit
    stray: float = 0.0  # share of zones and frames with a return from nothing
    driver: str = SIMULATED  # or ur:HOST
    armed: bool = False  # may a real arm be moved? only watched otherwise
    world: str = "honest"  # or ideal, each with single parts: honest,mounting=0 (`Budget`)
    apart: bool = False  # compute simulated frames in a process of their own: with a page

    def __post_init__(self) -> None:
        if not 50.0 <= self.rate <= 500.0:
            raise ConfigError(f"rate = {self.rate:g} Hz; give a value from 50 to 500")
        read_budget(self.world)
        if self.armed and not self.cell:
            raise ConfigError(
                "--arm needs to know the cell, or the arm takes its own table for free space; "
                "write one (static_assets/cells/table.toml shows how) and give --cell FILE"
            )
        _check_driver(self)


def build_engine(setup: Setup, clock: Clock, params: Params | None = None) -> Engine:
    """A ready engine, not yet started; raises a FlinchError before anything has begun."""
    robot = build_robot(setup)
    skin = choose_skin(setup, robot)
    programs = shipped_programs()
    if setup.program:
        own = load_program(find_program(setup.program))
        programs[own.name] = own
    scene = load_scene(find_scene(setup.scene), setup.seed)
    home, simulated = choose_home(setup, scene, robot), setup.driver == SIMULATED
    cell, learned_file = _cell(setup, scene)
    held: list[Arm | Source] = []
    try:
        source, world = _source(setup, robot, skin, scene, clock)
        held.append(source)
        arm = _arm(setup, robot, home if world is not None else None, _encoders(source))
        held.append(arm)
        engine = assemble(
            robot, skin, arm, source, world, clock, rate=setup.rate,
            start=Start(
                cell, params, programs=programs,
                # a real arm stays where it is until a person says where to go, and when
                goal=scene.goal if simulated and world is not None else None,
                begin=Mode.RUNNING if simulated else Mode.HOLDING,
                scene=scene.title if world is not None else _real_title(setup),
                look_every=PICTURE if setup.apart else 0.0,
            ),
        )  # fmt: skip
        if isinstance(source, MixedSkin | SimulatedSkinApart):
            source.wait()  # it has begun while the rest was made
        near = warnings(robot, cell, arm.state(clock.now()).q)
        engine.warnings = (*blind_words(robot, skin), *near)
        if learned_file is not None:
            engine.follow(Keeper(learned_file, engine.post))
        if setup.ghost:
            engine.ghost = _ghost(setup, engine, world, source, arm.state(clock.now()).q)
    except BaseException:
        for part in held:
            part.close()
        raise
    if setup.program:
        engine.post(RunProgram(own.name))
    return engine


def plant_alone(setup: Setup, robot: Robot, skin: Skin, clock: Clock) -> tuple[RealPlant, Source]:
    """Arm and sensors without a brain, whoever reads it moves the arm himself; and the sensors."""
    scene = load_scene(find_scene(setup.scene), setup.seed)
    source, world = _source(setup, robot, skin, scene, clock)
    try:
        home = choose_home(setup, scene, robot)
        arm = _arm(setup, robot, home if world is not None else None, _encoders(source))
    except BaseException:
        source.close()
        raise
    return build_plant(robot, skin, arm, source, world), source


@dataclass(frozen=True)
class Start:
    """What an engine knows and does at first.

    cell:       the known static place, None: nothing is known.   scene: what the page calls it.
    goal:       None: the tool stays where it is.   programs: those that may be run, by name.
    look_every: [s] between two looks of onlookers at the simulated world.
    perception: a study's own instead of the one that frames are given to.
    """

    cell: Cell | None = None
    params: Params | None = None
    goal: Goal | None = None
    programs: Mapping[str, Program] | None = None
    begin: Mode = Mode.RUNNING
    scene: str = ""
    look_every: float = 0.0
    perception: Perceiver | None = None


def assemble(
    robot: Robot, skin: Skin, arm: Arm, source: Source, world: World | None, clock: Clock,
    start: Start = Start(), rate: float = 250.0,
) -> Engine:  # fmt: skip
    """An engine of these parts; `world` None: what the sensors see is real."""
    brain = Brain(
        limited(robot, arm.limits), skin, start.cell, start.params,
        goal=start.goal, programs=start.programs, begin=start.begin, perception=start.perception,
    )  # fmt: skip
    plant = build_plant(brain.robot, skin, arm, source, world, start.look_every)
    return Engine(brain, plant, clock, rate=rate, scene=start.scene)


def build_plant(
    robot: Robot, skin: Skin, arm: Arm, source: Source, world: World | None, look_every: float = 0.0
) -> RealPlant:
    """The plant that these parts make; without a world what the sensors see is real."""
    if world is None:
        return RealPlant(robot, arm, source)
    if isinstance(source, SimulatedEyes):
        robot = source.truth.robot
    if isinstance(source, MixedSkin):
        return MixedPlant(robot, arm, source, world, skin, look_every)
    return SimulatedPlant(robot, arm, source, world, look_every)


def _ghost(setup: Setup, engine: Engine, world: World | None, source: Source, q: Array) -> Ghost:
    """A second brain on a simulated plant of its own, which begins where the arm is."""
    if world is None or isinstance(source, MixedSkin):
        raise ConfigError("a ghost needs a simulated world; leave --ghost or --sensors out")
    mode, brain = kind_of(setup.ghost, "ghost").name, engine.brain
    eye = _eye(setup, brain.robot, world)
    if isinstance(eye, SimulatedSkinApart):
        eye.wait()
    arm = SimulatedArm(brain.robot, q, noise=eye.truth.encoders, seed=setup.seed)
    plant = SimulatedPlant(eye.truth.robot, arm, eye, world)
    return Ghost(brain.sibling(mode), plant, mode)


def limited(robot: Robot, limits: Limits) -> Robot:
    """The robot as its arm lets it move: the controller plans with these velocities."""
    return replace(
        robot,
        qd_max=freeze(np.minimum(robot.qd_max, limits.qd_max)),
        qdd_max=freeze(np.minimum(robot.qdd_max, limits.qdd_max)),
    )


def _cell(setup: Setup, scene: Scene) -> tuple[Cell, Path | None]:
    """The known place, and the file that keeps what is learned of it, if one does.

    A person's own cell file keeps it itself; a shipped one, or a scene, is not written to.
    """
    cell, keeps = scene.cell, setup.background
    if setup.cell:
        path = find_cell(setup.cell)
        cell = read_cell(path)
        if keeps is None and path == Path(setup.cell) and not is_scene(path):
            keeps = path
    if setup.background is not None and setup.background.exists():
        cell = replace(cell, learned=cell.learned.with_more(load_cell(setup.background).learned))
    return cell, keeps


def _real_title(setup: Setup) -> str:
    return "recorded world" if setup.sensors.startswith("replay:") else "real world"


def _source(
    setup: Setup, robot: Robot, skin: Skin, scene: Scene, clock: Clock
) -> tuple[Source, World | None]:
    """Where the frames come from, and the simulated world that is seen, if any is."""
    real, mixed, _ = setup.sensors.partition("+simulated")
    if setup.sensors != SIMULATED and not mixed:
        # real sensors see a real world; drawing a simulated one would mislead
        return _real_source(real, skin, clock), None
    world = World(scene.bodies)
    eye = _eye(setup, robot, world)
    return (MixedSkin(_real_source(real, skin, clock), eye) if mixed else eye), world


def _eye(setup: Setup, robot: Robot, world: World) -> SimulatedSkin | SimulatedSkinApart:
    """The truth is drawn from the skin as laid out, whatever else is believed of it."""
    kind = SimulatedSkinApart if setup.apart else SimulatedSkin
    errors, budget = ErrorModel(ghosts=setup.stray), read_budget(setup.world)
    return kind(robot, lay_out(robot), world, setup.seed, errors, budget=budget)


def _encoders(source: Source) -> float:
    """[rad] noise of a simulated arm's encoders; none beside real sensors alone."""
    return source.truth.encoders if isinstance(source, SimulatedEyes) else 0.0


def choose_home(setup: Setup, scene: Scene, robot: Robot) -> Array | None:
    """The posture to begin in; None for the robot's own."""
    home = scene.home
    if setup.choice.home_deg or scene.robot not in ("", robot.name):
        return None  # a posture of another robot means nothing here; its own does
    if home is not None and len(home) != robot.n:
        raise ConfigError(
            f"scene {setup.scene!r}: home_deg has {len(home)} values, {robot.name} has "
            f"{robot.n} joints; choose a scene made for this robot, or give the posture with "
            "--home-deg"
        )
    return home


def _arm(setup: Setup, robot: Robot, home: Array | None, noise: float) -> Arm:
    if setup.driver == SIMULATED:
        return SimulatedArm(robot, home, noise=noise, seed=setup.seed)
    from app.robot.ur.driver import UrArm

    return UrArm(setup.driver.removeprefix("ur:"), robot, armed=setup.armed)


def _check_driver(setup: Setup) -> None:
    """ConfigError for an arm that there is no driver for, or that is asked for by halves."""
    kind, _, host = setup.driver.partition(":")
    if setup.driver == SIMULATED:
        if setup.armed:
            raise ConfigError("--arm belongs to a real arm; add --driver ur:HOST")
    elif kind != "ur" or not host or ":" in host:
        raise ConfigError(
            f"driver = {setup.driver!r}; give 'simulated' or 'ur:HOST' (a UR's ports are fixed)"
        )
    elif setup.choice.home_deg:
        raise ConfigError("a real arm begins where it stands; leave --home-deg or --driver out")


def build_robot(setup: Setup) -> Robot:
    """The robot that a setup names, in the covers of its layout: a folder, a bare URDF, or a
    public description."""
    choice = replace(setup.choice, skin=setup.skin)
    if setup.urdf:
        return load_urdf(Path(setup.urdf), choice)
    if setup.robot.startswith(PREFIX):
        return load_urdf(find_description(setup.robot.removeprefix(PREFIX)), choice)
    return load_robot(find_robot(setup.robot), choice)


def choose_skin(setup: Setup, robot: Robot) -> Skin:
    """What is believed of the layout whose covers the robot wears, as `build_robot` chose it."""
    skin = lay_out(robot)
    kind, _, ports = setup.sensors.partition("+simulated")[0].partition(":")
    if kind == "serial" and ports:
        skin = with_stamp_doubt(skin, ports)
    if setup.ranges is not None:
        skin = replace(skin, ranges=complete(load_ranges(setup.ranges, skin.slots)))
    return with_mounts(skin, load_mounts(setup.mounts), robot) if setup.mounts else skin


def lay_out(robot: Robot) -> Skin:
    """The skin exactly as the layout says whose covers the robot wears."""
    if robot.layout is None:
        raise RobotError(f"{robot.name} names no skin of its own; choose a layout with --skin")
    return load_skin(robot.layout, robot)


def build_robot_and_skin(setup: Setup) -> tuple[Robot, Skin]:
    """Both; RobotError where neither the setup nor the robot names a layout."""
    robot = build_robot(setup)
    return robot, choose_skin(setup, robot)


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
