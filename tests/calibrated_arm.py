"""A few sensors of an arm beside a board, driven and recorded: for tests of the calibration."""

from dataclasses import dataclass, replace

import numpy as np

from app.calibration.motion import Drive
from app.calibration.planes import Plane, planes_of
from app.calibration.postures import Plan, travel_time
from app.calibration.recording import Recording
from app.calibration.session import REST, displace_boards
from app.plant.simulated import SimulatedPlant
from app.robot.arm import SimulatedArm
from app.robot.model import Robot
from app.robot.skin import Skin, build_skin
from app.sensing.budget import read_budget
from app.sensing.simulated import SimulatedSkin
from app.sensing.truth import Truth
from app.timing import ManualClock
from app.world.scene import Scene, find_scene, load_scene
from app.world.world import World

SPEED = 1.0


@dataclass(frozen=True)
class Gathered:
    """What a calibration is given, and the truth behind it."""

    robot: Robot
    skin: Skin
    planes: tuple[Plane, ...]
    recording: Recording
    truth: Truth


def some_of(skin: Skin, robot: Robot, names: tuple[str, ...]) -> Skin:
    """The skin with these sensors alone."""
    return build_skin(skin.title, tuple(skin.sensors[skin.index(n)] for n in names), robot)


def postures(robot: Robot, scene: Scene, skin: Skin, count: int, seed: int) -> np.ndarray:
    """Postures in which the sensors are often near the board; nobody asks whether they are safe."""
    from app.calibration.postures import Planner
    from app.cell.parts import Cell

    planner = Planner(robot, skin, planes_of(scene), Cell(), seed)
    rng, out = np.random.default_rng(seed), [robot.home]
    while len(out) < count:
        q = robot.home + np.append(rng.uniform(-2, 2, 3), np.zeros(3))
        q = np.clip(q, robot.q_min + 0.1, robot.q_max - 0.1)
        if planner._near(robot.posture(q)).any() or rng.random() < 0.03:
            out.append(q)
    return np.array(out)


def gathered(
    robot: Robot, skin: Skin, world: str, seed: int = 0, scene: str = "calibration", count: int = 40
) -> Gathered:
    """The arm driven through some postures."""
    there = load_scene(find_scene(scene))
    q = postures(robot, there, skin, count, seed)
    bodies, clock = World(there.bodies), ManualClock()
    eye = SimulatedSkin(robot, skin, bodies, seed, budget=read_budget(world))
    truth = eye.truth
    arm = SimulatedArm(robot, noise=truth.encoders, seed=seed)
    plant = SimulatedPlant(truth.robot, arm, eye, bodies)
    displace_boards(plant, there, seed)
    seconds = REST + sum(travel_time(w, SPEED) + REST for w in np.diff(q, axis=0))
    drive = Drive(robot, skin, plant, clock, SPEED)
    recording = drive.run(Plan(q, seconds), REST, lambda share: None)
    return Gathered(robot, skin, planes_of(there), recording, truth)


def renamed(recording: Recording, sensor: np.ndarray) -> Recording:
    """The same frames from other sensors: frame of i comes from sensor[i]."""
    return replace(recording, sensor=sensor[recording.sensor].astype(np.int16))


def reordered(recording: Recording, k: int, zone: np.ndarray) -> Recording:
    """The frames of sensor k with their zones in another order."""
    mine = recording.sensor == k
    changed = {}
    for name in ("distance", "status", "targets"):
        values = getattr(recording, name).copy()
        values[mine] = values[mine][:, zone]
        changed[name] = values
    return replace(recording, **changed)
