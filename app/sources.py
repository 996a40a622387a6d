"""Names into sensors: simulated, recorded, on serial ports, or mixed."""

from app.choices import lay_out
from app.errors import SensorError
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.budget import read_budget
from app.sensing.error_model import ErrorModel
from app.sensing.mixed import MixedSkin
from app.sensing.open_ports import open_skin
from app.sensing.replays import open_replay
from app.sensing.simulated import SimulatedSkin
from app.sensing.simulated_apart import SimulatedSkinApart
from app.sensing.source import Source
from app.setup import SIMULATED, Setup
from app.timing import Clock, ManualClock, WallClock
from app.world.scene import Scene
from app.world.world import World

SimulatedEyes = SimulatedSkin | SimulatedSkinApart | MixedSkin


def real_title(setup: Setup) -> str:
    return "recorded world" if setup.sensors.startswith("replay:") else "real world"


def build_source(
    setup: Setup, robot: Robot, skin: Skin, scene: Scene, clock: Clock,
    recorded: Source | None = None,
) -> tuple[Source, World | None]:  # fmt: skip
    """Where the frames come from, and the simulated world that is seen, if any is.

    recorded: the skin of a whole recorded run, where the setup names one.
    """
    real, mixed, _ = setup.sensors.partition("+simulated")
    if setup.sensors != SIMULATED and not mixed:
        # real sensors see a real world; drawing a simulated one would mislead
        return recorded or _real_source(real, skin, clock), None
    world = World(scene.bodies)
    eye = build_eye(setup, robot, world)
    if not mixed:
        return eye, world
    return MixedSkin(recorded or _real_source(real, skin, clock), eye), world


def build_eye(setup: Setup, robot: Robot, world: World) -> SimulatedSkin | SimulatedSkinApart:
    """The truth is drawn from the skin as laid out, whatever else is believed of it."""
    kind = SimulatedSkinApart if setup.apart else SimulatedSkin
    errors, budget = ErrorModel(ghosts=setup.stray), read_budget(setup.world)
    return kind(robot, lay_out(robot), world, setup.seed, errors, budget=budget)


def encoder_noise(source: Source) -> float:
    """[rad] noise of a simulated arm's encoders; none beside real sensors alone."""
    return source.truth.encoders if isinstance(source, SimulatedEyes) else 0.0


def clock_for(setup: Setup) -> Clock:
    """Time for a run without a page: as fast as it goes, but real ports speak in real time."""
    return WallClock() if setup.sensors.startswith("serial:") else ManualClock()


def _real_source(sensors: str, skin: Skin, clock: Clock) -> Source:
    kind, _, rest = sensors.partition(":")
    if kind == "replay" and rest:
        return open_replay(rest, skin)
    if kind == "serial" and rest:
        return open_skin(rest, skin, clock)
    raise SensorError(
        f"sensors = {sensors!r}; give 'simulated', 'replay:PATH[@SENSOR]' or 'serial:PORT', "
        "the last two also with '+simulated'"
    )
