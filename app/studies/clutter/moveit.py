"""MotionBenchMaker's problems of a UR5, from MoveIt's YAML files, made into ones of a UR10e.

C. Chamzas et al., "MotionBenchMaker: a tool to generate and benchmark motion planning datasets",
IEEE RA-L 7 (2), 2022; a folder has pairs request####.yaml and scene####.yaml. Both arms are of one
kind, and a UR10e's links are longer by `SCALE`: so are all places and sizes then, and the way from
the base to the flange. The gripper of the UR5 is left out.
"""

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from msgspec import Meta, Struct

from app.errors import ConfigError
from app.messages import Array, freeze
from app.poses import transform
from app.robot.posture import rotation_matrix
from app.studies.clutter.problem import Problem
from app.toml import checked
from app.world.motion import Still
from app.world.shapes import shape_of
from app.world.tables import BoxShape, CylinderShape
from app.world.world import Body

SCALE = 1.45  # upper arm 0.6127 / 0.425, forearm 0.5716 / 0.3922
JOINTS = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", *(
    f"wrist_{i}_joint" for i in (1, 2, 3)))  # fmt: skip
T_WORLD_BASE = transform(np.array([0.0, 0.0, 0.9144]), np.array([0.0, 0.0, 1.57]))  # of the set
# Denavit and Hartenberg's parameters of a UR5, as its maker gives them [m]
DH_D = (0.089159, 0.0, 0.0, 0.10915, 0.09465, 0.0823)
DH_A = (0.0, -0.425, -0.39225, 0.0, 0.0, 0.0)
DH_ALPHA = (np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0)
GREY = (154, 160, 166)
Numbers3 = tuple[float, float, float]
Numbers4 = tuple[float, float, float, float]


class JointState(Struct, frozen=True):
    name: list[str]
    position: list[float]


class RobotState(Struct, frozen=True):
    joint_state: JointState


class JointConstraint(Struct, frozen=True):
    joint_name: str
    position: float


class Constraints(Struct, frozen=True):
    joint_constraints: list[JointConstraint]


class Request(Struct, frozen=True):
    """What of a request####.yaml is read."""

    start_state: RobotState
    goal_constraints: Annotated[list[Constraints], Meta(min_length=1)]


class Primitive(Struct, frozen=True):
    type: Literal["box", "cylinder"]
    dimensions: list[float]


class Pose(Struct, frozen=True):
    """orientation: a quaternion x, y, z, w."""

    position: Numbers3 = (0.0, 0.0, 0.0)
    orientation: Numbers4 = (0.0, 0.0, 0.0, 1.0)


class CollisionObject(Struct, frozen=True):
    id: str
    primitives: list[Primitive]
    primitive_poses: list[Pose]
    pose: Pose = Pose()


class Objects(Struct, frozen=True):
    collision_objects: list[CollisionObject]


class PlanningScene(Struct, frozen=True):
    """What of a scene####.yaml is read."""

    world: Objects


def requests_of(folder: Path) -> list[Path]:
    """The requests of a folder in their order; ConfigError if there are none."""
    found = sorted(folder.glob("request*.yaml"))
    if not found:
        raise ConfigError(f"{folder}: no request####.yaml in it; give a folder of problems")
    return found


def sets_of(folder: Path) -> list[Path]:
    """The folders of problems in a folder, or itself."""
    within = sorted(p for p in folder.glob("*") if p.is_dir() and any(p.glob("request*.yaml")))
    if not within:
        requests_of(folder)
    return within or [folder]


def load_problem(request: Path) -> tuple[Problem, Array]:
    """The problem for a UR10e, and joints (6,) [rad] near its goal, those of the UR5.

    Raises ConfigError naming the file for what cannot be read.
    """
    asked: Request = _read(request, Request)
    path = request.with_name(request.name.replace("request", "scene"))
    scene: PlanningScene = _read(path, PlanningScene)
    state = asked.start_state.joint_state
    start = dict(zip(state.name, state.position, strict=False))
    goal = {c.joint_name: c.position for c in asked.goal_constraints[0].joint_constraints}
    for joints in (start, goal):
        if missing := [name for name in JOINTS if name not in joints]:
            raise ConfigError(f"{request}: no {', '.join(missing)}; give problems of a UR5")
    q_start, q_goal = (np.array([q[name] for name in JOINTS]) for q in (start, goal))
    T = flange_of_ur5(q_goal)
    T[:3, 3] *= SCALE
    return Problem(request.stem, q_start, T, bodies_of(scene, path)), q_goal


def flange_of_ur5(q: Array) -> Array:
    """T_base_flange (4, 4) of a UR5 at joints (6,) [rad]; its base looks ahead along x."""
    T = transform(np.zeros(3), np.array([0.0, 0.0, np.pi]))  # the maker's base looks back
    for qi, d, a, alpha in zip(q, DH_D, DH_A, DH_ALPHA, strict=True):
        turn = transform(np.array([0.0, 0.0, d]), np.array([0.0, 0.0, float(qi)]))
        T = T @ turn @ transform(np.array([a, 0.0, 0.0]), np.array([alpha, 0.0, 0.0]))
    return T


def bodies_of(scene: PlanningScene, path: Path) -> tuple[Body, ...]:
    """All boxes and cylinders, in the base frame, larger by `SCALE`."""
    out = []
    for thing in scene.world.collision_objects:
        for i, (shape, at) in enumerate(
            zip(thing.primitives, thing.primitive_poses, strict=False), start=1
        ):
            name = thing.id if len(thing.primitives) == 1 else f"{thing.id} {i}"
            where = f"{path}: object {thing.id!r}"
            T = np.linalg.inv(T_WORLD_BASE) @ _matrix(thing.pose) @ _matrix(at)
            T[:3, 3] *= SCALE
            made = shape_of(_shape(shape, where), path.parent, where)
            out.append(Body(name, made, GREY, Still(freeze(T)), movable=False))
    return tuple(out)


def _shape(shape: Primitive, where: str) -> BoxShape | CylinderShape:
    size = [SCALE * d for d in shape.dimensions]
    if len(size) != (3 if shape.type == "box" else 2) or min(size) <= 0.0:
        raise ConfigError(f"{where}: dimensions = {shape.dimensions}; give lengths above 0")
    if shape.type == "box":
        return BoxShape((size[0], size[1], size[2]))
    return CylinderShape(radius_m=size[1], length_m=size[0])  # MoveIt's order: height, radius


def _matrix(pose: Pose) -> Array:
    v, w = np.array(pose.orientation[:3]), pose.orientation[3]
    sine = float(np.linalg.norm(v))
    T = np.eye(4)
    T[:3, 3] = pose.position
    if sine > 1e-12:
        T[:3, :3] = rotation_matrix(v / sine * 2.0 * np.arctan2(sine, w))
    return T


def _read(path: Path, kind: type[Any]) -> Any:
    try:
        raw = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as e:
        why = " ".join(str(e).split())
        raise ConfigError(f"{path}: cannot be read ({why}); give another folder") from e
    return checked(raw, kind, str(path), ConfigError)
