"""A robot like another one, but for how its joints truly lie and how its links truly look."""

from collections.abc import Sequence
from dataclasses import replace

import pinocchio as pin

from app.messages import Array
from app.raycast import RigidMesh
from app.robot.meshes import BodyMesh
from app.robot.model import Robot


def with_joint_errors(robot: Robot, twist: Array) -> Robot:
    """The robot whose joint frames are moved by twist (n, 6): position [m] and rotation [rad],
    each in the axes of the joint's own frame."""
    model = robot._model.copy()
    for j, error in enumerate(twist, start=1):  # pinocchio's joint 0 is the base
        moved = pin.SE3(pin.exp3(error[3:].copy()), error[:3].copy())
        model.jointPlacements[j] = model.jointPlacements[j] * moved
    return replace(robot, _model=model, _data=model.createData())


def with_bodies(robot: Robot, bodies: Sequence[BodyMesh]) -> Robot:
    """The robot with other surfaces, one a body link, link frame."""
    return replace(
        robot, bodies=tuple(bodies), rigid=tuple(RigidMesh(b.vertices, b.faces) for b in bodies)
    )
