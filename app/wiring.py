"""Facts into an engine: brain and plant put together. Decides nothing else."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from app.actions import RunProgram
from app.brain import Brain
from app.cell.files import load_cell
from app.cell.parts import Cell
from app.choices import build_robot, choose_home, choose_skin, limited
from app.config import Params
from app.control.beginning import warnings
from app.control.program_reach import reach_words
from app.control.programs import Program, find_program, load_program, shipped_programs
from app.control.registry import kind_of
from app.errors import ConfigError
from app.ghost import Ghost
from app.keeper import Keeper
from app.messages import Array, Goal, Mode
from app.perception.perceiver import Perceiver
from app.plant.mixed import MixedPlant
from app.plant.plant import Arm
from app.plant.real import RealPlant
from app.plant.simulated import SimulatedPlant
from app.replay.skin import RecordedSkin, recorded_skin
from app.robot.arm import SimulatedArm
from app.robot.blind import blind_words
from app.robot.model import Robot
from app.robot.skin import Skin
from app.runtime import Engine
from app.sensing.mixed import MixedSkin
from app.sensing.simulated_apart import SimulatedSkinApart
from app.sensing.source import Source
from app.setup import SIMULATED, Setup, driver_host
from app.sources import SimulatedEyes, build_eye, build_source, encoder_noise, real_title
from app.timing import Clock
from app.world.cells import find_cell, is_scene, read_cell
from app.world.scene import Scene, find_scene, load_scene
from app.world.world import World

# A study's own perception of a world of which a cell is known.
Perceive = Callable[[Robot, Skin, World, Cell], Perceiver]
PICTURE = 1.0 / 60.0  # [s] a page shows no more of the world than this


def build_engine(
    setup: Setup, clock: Clock, params: Params | None = None, perceive: Perceive | None = None,
    scene: Scene | None = None,
) -> Engine:  # fmt: skip
    """A ready engine, not yet started; raises a FlinchError before anything has begun.

    perceive: makes a study's own perception of a simulated world.
    scene:    a study's own, instead of the setup's file.
    """
    robot = build_robot(setup)
    skin = choose_skin(setup, robot)
    programs = shipped_programs()
    if setup.program:
        own = load_program(find_program(setup.program))
        programs[own.name] = own
    scene = scene or load_scene(find_scene(setup.scene), setup.seed, setup.person)
    home, simulated = choose_home(setup, scene, robot), setup.driver == SIMULATED
    cell, learned_file = _cell(setup, scene)
    held: list[Arm | Source] = []
    try:
        recorded = recorded_skin(setup, skin)
        held += [recorded] if recorded else []
        source, world = build_source(setup, robot, skin, scene, clock, recorded)
        held.append(source)
        arm = _arm(setup, robot, _begin(setup, recorded, world, home), encoder_noise(source))
        held.append(arm)
        engine = assemble(
            robot, skin, arm, source, world, clock, rate=setup.rate,
            start=Start(
                cell, params, programs=programs,
                # a real arm stays where it is until a person says where to go, and when
                goal=scene.goal if simulated and world is not None else None,
                begin=Mode.RUNNING if simulated else Mode.HOLDING,
                scene=scene.title if world is not None else real_title(setup),
                look_every=PICTURE if setup.apart else 0.0,
                perception=perceive(robot, skin, world, cell)
                if perceive and world is not None else None,
            ),
        )  # fmt: skip
        if isinstance(source, MixedSkin | SimulatedSkinApart):
            source.wait()  # it has begun while the rest was made
        near = warnings(engine.robot, cell, arm.state(clock.now()).q)
        lost = reach_words(own, engine.robot, cell) if setup.program else ()
        engine.warnings = (*lost, *blind_words(robot, skin), *near)
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


def _begin(
    setup: Setup, recorded: RecordedSkin | None, world: World | None, home: Array | None
) -> Array | None:
    """Where the arm begins: in a simulated world as its scene says, with the frames of a recording
    where they were seen from; None for the robot's own home."""
    if recorded is not None and not setup.choice.home_deg and recorded.posture is not None:
        return recorded.posture
    return home if world is not None else None


def plant_alone(setup: Setup, robot: Robot, skin: Skin, clock: Clock) -> tuple[RealPlant, Source]:
    """Arm and sensors without a brain, whoever reads it moves the arm himself; and the sensors."""
    scene = load_scene(find_scene(setup.scene), setup.seed, setup.person)
    source, world = build_source(setup, robot, skin, scene, clock, recorded_skin(setup, skin))
    try:
        home = choose_home(setup, scene, robot)
        arm = _arm(setup, robot, home if world is not None else None, encoder_noise(source))
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
    eye = build_eye(setup, brain.robot, world)
    if isinstance(eye, SimulatedSkinApart):
        eye.wait()
    arm = SimulatedArm(brain.robot, q, noise=eye.truth.encoders, seed=setup.seed)
    plant = SimulatedPlant(eye.truth.robot, arm, eye, world)
    return Ghost(brain.sibling(mode), plant, mode)


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


def _arm(setup: Setup, robot: Robot, home: Array | None, noise: float) -> Arm:
    if setup.driver == SIMULATED:
        return SimulatedArm(robot, home, noise=noise, seed=setup.seed)
    from app.robot.ur.driver import UrArm

    return UrArm(driver_host(setup.driver), robot, armed=setup.armed)
