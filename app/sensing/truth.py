"""What is really so of an arm and its skin, drawn from the error budget: for simulation alone.

The brain has the `Robot` and the `Skin` that it believes in. Beside them stand another robot,
whose joints and links are where they truly are, and another skin, whose sensors are where the
glue holds them. Only simulated devices, judges and studies look at them.

Every part draws from a stream of its own: switching one off leaves the others' draws as they are.
"""

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from app.messages import Array, freeze
from app.robot.model import Robot
from app.robot.perturbed import with_joint_errors
from app.robot.posture import rotation_matrix
from app.robot.skin import Skin, build_skin
from app.sensing.budget import IDEAL, Budget

# sizes at strength 1
MOUNTING = np.array([0.002] * 3 + [np.radians(0.5)] * 3)  # [m, rad] a printed cover on a tube
KINEMATICS = np.array([0.0005] * 3 + [np.radians(0.05)] * 3)  # [m, rad] about what a UR's own
# calibration file differs by from the nominal robot
ENCODERS = 1e-4  # [rad]
JITTER = 0.002  # [s] of a frame's stamp


class Part(IntEnum):
    """Streams of random numbers, one a part; a number never changes its meaning."""

    MOUNTING = 0
    KINEMATICS = 1
    ENCODERS = 2
    TIME = 3
    BODY = 4
    REFLECTANCE = 5
    COVER = 6


@dataclass(frozen=True, eq=False, slots=True)
class Truth:
    """An arm and its skin as they are.

    robot:    its postures are true ones at true joint angles, its bodies the true surfaces.
    skin:     its sensors where they are.   laid_out: where the layout has them; a window moves
              with its sensor, so that this is how a sensor sees the cover of its own link.
    encoders: [rad] noise of the joint angles that are read.
    jitter:   [s] noise of the frames' stamps.   late: [s] by which they always are too late.
    """

    robot: Robot
    skin: Skin
    laid_out: Skin
    budget: Budget
    seed: int
    encoders: float = 0.0
    jitter: float = 0.0
    late: float = 0.0

    def stream(self, part: Part, *key: int) -> np.random.Generator:
        """The random numbers of a part, or of one thing in it."""
        return stream(self.seed, part, *key)


def stream(seed: int, part: Part, *key: int) -> np.random.Generator:
    """See `Truth.stream`; sensors' own streams have keys of length one (`app.sensing.streams`)."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(1 << 20, part, *key)))


def ideal_truth(robot: Robot, skin: Skin, seed: int = 0) -> Truth:
    """Everything is as it is believed to be."""
    return Truth(robot, skin, skin, IDEAL, seed)


def draw_truth(robot: Robot, skin: Skin, budget: Budget, seed: int) -> Truth:
    """The truth behind `robot` and `skin` as laid out, seeded."""
    return Truth(
        robot=_true_robot(robot, budget, seed),
        skin=_true_skin(robot, skin, budget, seed),
        laid_out=skin,
        budget=budget,
        seed=seed,
        encoders=ENCODERS * budget.encoders,
        jitter=JITTER * budget.time,
        late=1e-3 * budget.late_ms,
    )


def _true_robot(robot: Robot, budget: Budget, seed: int) -> Robot:
    if budget.kinematics:
        unit = stream(seed, Part.KINEMATICS).standard_normal((robot.n, 6))
        robot = with_joint_errors(robot, budget.kinematics * KINEMATICS * unit)
    return robot


def _true_skin(robot: Robot, skin: Skin, budget: Budget, seed: int) -> Skin:
    if not budget.mounting:
        return skin
    unit = stream(seed, Part.MOUNTING).standard_normal((skin.count, 6))
    errors = budget.mounting * MOUNTING * unit
    sensors = tuple(
        replace(s, T_link_sensor=freeze(s.T_link_sensor @ _moved(e)))
        for s, e in zip(skin.sensors, errors, strict=True)
    )
    return build_skin(skin.title, sensors, robot)


def _moved(error: Array) -> Array:
    """The pose (4, 4) of a position [m] and a rotation vector [rad], (6,)."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation_matrix(error[3:]), error[:3]
    return T
