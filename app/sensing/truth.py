"""What is really so of an arm and its skin, drawn from the error budget: for simulation alone.

The brain has the `Robot` and the `Skin` that it believes in. Beside them stand another robot,
whose joints and links are where they truly are, and another skin, whose sensors are where the
glue holds them. Only simulated devices, judges and studies look at them.
"""

from dataclasses import dataclass, replace

import numpy as np

from app.messages import Array, freeze
from app.robot.model import Robot
from app.robot.perturbed import with_bodies, with_joint_errors
from app.robot.posture import rotation_matrix
from app.robot.skin import Skin, build_skin
from app.sensing.budget import Budget
from app.sensing.true_body import true_bodies
from app.sensing.truth_parts import Part, stream

# sizes at strength 1
MOUNTING = np.array([0.002] * 3 + [np.radians(0.5)] * 3)  # [m, rad] a printed cover on a tube
KINEMATICS = np.array([0.0005] * 3 + [np.radians(0.05)] * 3)  # [m, rad] about what a UR's own
# calibration file differs by from the nominal robot
ENCODERS = 1e-4  # [rad]
JITTER = 0.002  # [s] of a frame's stamp


@dataclass(frozen=True, eq=False, slots=True)
class Truth:
    """An arm and its skin as they are.

    robot:    its postures are true ones at true joint angles, its bodies the true surfaces.
    skin:     its sensors where they are.
    modelled, laid_out: the robot and its skin as they are believed to be. A sensor is glued to its
              link, and its window moves with it: what it sees of these is as it was laid out.
    encoders: [rad] noise of the joint angles that are read.
    jitter:   [s] noise of the frames' stamps.   late: [s] by which they always are too late.
    """

    robot: Robot
    skin: Skin
    modelled: Robot
    laid_out: Skin
    budget: Budget
    seed: int
    encoders: float = 0.0
    jitter: float = 0.0
    late: float = 0.0


def draw_truth(robot: Robot, skin: Skin, budget: Budget, seed: int) -> Truth:
    """The truth behind `robot` and `skin` as laid out, seeded."""
    true_skin = _true_skin(robot, skin, budget, seed)
    return Truth(
        robot=_true_robot(robot, true_skin, budget, seed),
        skin=true_skin,
        modelled=robot,
        laid_out=skin,
        budget=budget,
        seed=seed,
        encoders=ENCODERS * budget.encoders,
        jitter=JITTER * budget.time,
        late=1e-3 * budget.late_ms,
    )


def _true_robot(robot: Robot, true_skin: Skin, budget: Budget, seed: int) -> Robot:
    if budget.body:
        robot = with_bodies(robot, true_bodies(robot, true_skin, budget.body, seed))
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
