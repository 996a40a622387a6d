"""A calibration from beginning to end: plan, move, record; simulated or live."""

from dataclasses import dataclass

import numpy as np

from app.actions import MoveObstacle
from app.calibration.motion import Drive, Moves, Progress, unheeded
from app.calibration.planes import planes_of
from app.calibration.postures import Plan, Planner, with_boards
from app.calibration.recording import Recording
from app.errors import ConfigError
from app.messages import Array
from app.plant.simulated import SimulatedPlant
from app.poses import transform
from app.robot.model import Robot
from app.robot.skin import Skin
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.timing import Clock
from app.wiring import plant_alone
from app.world.scene import Scene, find_scene, load_scene

REST = 0.8  # [s] in each posture
LONGEST, FASTEST = 3600.0, 1.0  # [s], [rad/s]
BOARD_OFF = 0.02, float(np.radians(1.5))  # one sigma of where a simulated board really stands
SEEN_MOVING = 0.25  # share of the ways on which the simulated skin is asked: to save its time


@dataclass(frozen=True)
class Pace:
    """seconds: at most, of the whole motion.   speed: [rad/s] of the fastest joint."""

    seconds: float = 300.0
    speed: float = 0.6

    def __post_init__(self) -> None:
        if not 10.0 <= self.seconds <= LONGEST:
            raise ConfigError(f"seconds = {self.seconds:g}; give 10 to {LONGEST:g}")
        if not 0.05 <= self.speed <= FASTEST:
            raise ConfigError(f"speed = {self.speed:g} rad/s; give 0.05 to {FASTEST:g}")


def read_scene(setup: Setup) -> Scene:
    """The things that are looked at."""
    return load_scene(find_scene(setup.scene), setup.seed)


def plan_motion(robot: Robot, skin: Skin, setup: Setup, q: Array, pace: Pace) -> Plan:
    """Postures from q (n,), where the arm is."""
    scene = read_scene(setup)
    planner = Planner(robot, skin, planes_of(scene), with_boards(scene), setup.seed)
    return planner.plan(q, pace.seconds, pace.speed, REST)


def gather(
    robot: Robot, skin: Skin, setup: Setup, clock: Clock, pace: Pace, progress: Progress,
    plan: Plan | None = None,
) -> Recording:  # fmt: skip
    """Drive the arm of `setup` through a plan and record what its skin says; without a plan one is
    made from where the arm is."""
    plant, source = plant_alone(setup, robot, skin, clock)
    try:
        if plan is None:
            q = plant.read(clock.now(), 1.0).joints.q
            plan = plan_motion(robot, skin, setup, q, pace)
        moves: Moves = unheeded
        if isinstance(plant, SimulatedPlant):
            displace_boards(plant, read_scene(setup), setup.seed)
        if isinstance(source, SimulatedSkin):
            moves = _seldom(source, skin.count, setup.seed)
        return Drive(robot, skin, plant, clock, pace.speed).run(plan, REST, progress, moves)
    finally:
        plant.close()


def displace_boards(plant: SimulatedPlant, scene: Scene, seed: int) -> None:
    """Stand what may be moved where nobody has measured it, seeded."""
    rng = np.random.default_rng([seed, 0xB0A2D])
    for body in scene.bodies:
        if body.movable:
            off = rng.standard_normal(6) * np.repeat(BOARD_OFF, 3)
            T = body.motion.pose(0.0) @ transform(off[:3], off[3:])
            plant.act(MoveObstacle(body.name, T))


def _seldom(eye: SimulatedSkin, sensors: int, seed: int) -> Moves:
    """Asks a simulated skin on some of the ways only: what takes the time of a simulation is
    rays, and few frames of a moving arm tell how late the stamps are."""
    rng = np.random.default_rng([seed, 0x5E])

    def moves(sets_out: bool) -> None:
        silent = sets_out and rng.random() > SEEN_MOVING
        eye.muted = set(range(sensors)) if silent else set()

    return moves
