"""From a URDF's text to pinocchio's model, and what is asked of it once."""

from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from app.errors import RobotError, options
from app.messages import Array
from app.robot.gears import Gears

LOOSE = 0.1  # [rad or m, and a second] a follower's own limits are never what holds


def build_model(xml: str, urdf: Path) -> Any:
    """pinocchio's model; raises `RobotError` for what cannot be an arm. `urdf` is for messages."""
    try:
        model = pin.buildModelFromXML(xml)
    except (ValueError, RuntimeError) as e:
        raise RobotError(f"{urdf}: pinocchio cannot build it ({_one_line(e)}); mend it") from e
    for name, joint in zip(joint_names(model), list(model.joints)[1:], strict=True):
        if joint.nq != 1 or joint.nv != 1:
            raise RobotError(
                f"{urdf}: joint {name!r} has {joint.nv} degrees of freedom; "
                "use revolute, continuous, prismatic or fixed joints"
            )
        low, high = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        if not (np.isfinite([low, high]).all() and low < high):
            raise RobotError(
                f"{urdf}: joint {name!r} has the limits {low:g} to {high:g}; "
                "give its <limit> a lower and an upper value"
            )
    if model.nv == 0:
        raise RobotError(f"{urdf}: has no moving joint; give an arm")
    return model


def lead(model: Any, gears: Gears) -> None:
    """Give the joints that follow another the limits that follow from their master's.

    What a URDF says of them itself is left out, as pinocchio does: it often contradicts the
    master's, and nothing moves them but the master.
    """
    low, high, speed = (
        model.lowerPositionLimit, model.upperPositionLimit, model.velocityLimit,
    )  # fmt: skip
    for j in np.flatnonzero(~gears.own):
        i, times, offset = int(gears.into[j]), float(gears.times[j]), float(gears.offset[j])
        ends = sorted((times * low[i] + offset, times * high[i] + offset))
        low[j], high[j] = ends[0] - LOOSE, ends[1] + LOOSE
        speed[j] = abs(times) * speed[i] + LOOSE


def joint_names(model: Any) -> tuple[str, ...]:
    """The joints that move, in the order of q."""
    return tuple(str(n) for n in model.names)[1:]


def slides(model: Any) -> NDArray[np.bool_]:
    """(n,) which joints are prismatic."""
    return np.array(["P" in j.shortname().removeprefix("JointModel") for j in model.joints][1:])


def from_table(values: list[float], model: Any) -> Array:
    """Joint positions [rad or m] of a table's values [degrees, or mm for a sliding joint]."""
    unit = np.where(slides(model), 1e-3, radians(1.0))
    return np.array(values) * unit


def check_joint_values(values: Any, key: str, model: Any, where: object) -> None:
    """One value a joint, or a RobotError that lists the joints."""
    joints = joint_names(model)
    if len(values) != len(joints):
        raise RobotError(
            f"{where}: {key} has {len(values)} values, the arm has {len(joints)} joints "
            f"({', '.join(joints)}); give one a joint"
        )


def check_home(home: Array, model: Any, where: object) -> None:
    """Home within the limits, or a RobotError that names the joint."""
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    outside = np.flatnonzero((home < low) | (home > high))
    if len(outside):
        joint = joint_names(model)[outside[0]]
        raise RobotError(f"{where}: home_deg is outside the limits of {joint}; move it inside")


def frame_index(model: Any, name: str, where: object) -> int:
    """pinocchio's index of a link's frame."""
    if not model.existFrame(name, pin.FrameType.BODY):
        known = [f.name for f in model.frames if f.type == pin.FrameType.BODY]
        raise RobotError(f"{where}: no link {name!r} in the URDF; {options(name, known)}")
    return int(model.getFrameId(name, pin.FrameType.BODY))


def support(model: Any, frame: int) -> Array:
    """(n,) 1.0 for the joints between the base and the frame."""
    mask = np.zeros(model.nv)
    for j in list(model.supports[model.frames[frame].parentJoint])[1:]:
        mask[model.joints[j].idx_v] = 1.0
    return mask


def welded(model: Any, frames: tuple[int, ...]) -> NDArray[np.bool_]:
    """(L, L) True where no moving joint lies between two frames; a link is welded to itself."""
    joint = np.array([model.frames[f].parentJoint for f in frames])
    return np.asarray(joint[:, None] == joint)


def in_joint(model: Any, frames: tuple[int, ...]) -> Array:
    """(L, 4, 4) pose of each frame in that of the joint that moves it; it never changes."""
    return np.array([model.frames[f].placement.homogeneous for f in frames])


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]
