"""The joints of a motion file as the parts of a person, or as one capsule a bone.

Joints are known by the names that CMU's files, Mixamo, AnimatedDrawings and others give them.
Where those are missing, every bone gets a capsule as thick as bones of its length are.
"""

import re
from dataclasses import dataclass

import numpy as np

from app.messages import Array
from app.world.build import ANKLE, HAND, PARTS, TOE, Colour
from app.world.bvh import END, Skeleton

SIDES = {"left": ("left", "l"), "right": ("right", "r")}
ROLES = {  # of each side; the first name that there is counts
    "hip": ("upleg", "thigh", "upperleg", "femur", "hip"),
    "knee": ("leg", "shin", "calf", "lowerleg", "tibia", "knee"),
    "ankle": ("foot", "ankle"),
    "shoulder": ("arm", "upperarm", "uparm", "humerus", "shoulder"),
    "elbow": ("forearm", "lowerarm", "lowarm", "radius", "elbow"),
    "wrist": ("hand", "wrist"),
}
TOES = ("toebase", "toe", "toes", "ball")
HEADS, NECKS = ("head",), ("neck", "neck1", "lowerneck")
CHIN = 0.870  # of the stature: how high the head's joint is, as in `build`
HEAD = 0.075  # of the stature, from the head's joint to the middle of the head
SPINE = {"abdomen": (0.17, 0.45), "chest": (0.52, 0.71)}  # shares from the hips to the shoulders
SHORTEST = 0.03  # of the stature: what is shorter is no bone
SLIM = (0.02, 0.25, 0.08)  # radius of a bone: least, share of its length, most; of the stature
BONE = (122, 132, 148)
Z_UP = {1: np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), 2: np.eye(3)}  # from y or z up
STEEP = 1e-9


@dataclass(frozen=True, eq=False)
class Limbs:
    """Capsules of a clip over its frames, z up, in the clip's own units.

    ends: (F, n, 2, 3).   radius: (n,) as shares of the stature.
    lateral: (F, 3) from the right hip to the left one; None where nobody can tell.
    stature: in the clip's units.
    """

    names: tuple[str, ...]
    ends: Array
    radius: Array
    colours: tuple[Colour, ...]
    lateral: Array | None
    stature: float


def limbs_of(skeleton: Skeleton) -> Limbs:
    """The capsules of every frame."""
    at = {_plain(j.name): i for i, j in reversed(list(enumerate(skeleton.joints)))}
    found = _roles(at)
    return _bones(skeleton) if found is None else _person(skeleton, at, found)


def _plain(name: str) -> str:
    """A joint's name without what tools put before it, in small letters."""
    return re.sub(r"[^a-z0-9]", "", re.sub(r"^.*[:|]|^mixamorig\d*", "", name).lower())


def _find(at: dict[str, int], side: str, names: tuple[str, ...]) -> int | None:
    for name in names:
        for s in SIDES[side]:
            for whole in (s + name, name + s):
                if whole in at:
                    return at[whole]
    return None


def _roles(at: dict[str, int]) -> dict[str, int] | None:
    """Rows of the joints that a person has; None where one is missing."""
    found = {
        f"{side} {role}": _find(at, side, names) for side in SIDES for role, names in ROLES.items()
    }
    head = next((at[n] for n in HEADS if n in at), None)
    known = {name: row for name, row in found.items() if row is not None}
    return known | {"head": head} if head is not None and len(known) == len(found) else None


def _person(skeleton: Skeleton, at: dict[str, int], rows: dict[str, int]) -> Limbs:
    """The 17 parts of a person."""
    p = {name: skeleton.points[:, row] for name, row in rows.items()}
    feet = (p["left ankle"] + p["right ankle"]) / 2
    turn = _upright((p["head"] - feet).mean(axis=0))
    p = {name: x @ turn.T for name, x in p.items()}
    leg = np.mean([
        _length(p[f"{s} hip"], p[f"{s} knee"]) + _length(p[f"{s} knee"], p[f"{s} ankle"])
        for s in SIDES
    ])  # fmt: skip
    hips, shoulders = ((p[f"left {x}"] + p[f"right {x}"]) / 2 for x in ("hip", "shoulder"))
    above = _length(hips, shoulders) + _length(shoulders, p["head"])
    stature = (float(leg) + above) / (CHIN - ANKLE)
    neck = next((skeleton.points[:, at[n]] @ turn.T for n in NECKS if n in at), shoulders)
    crown = p["head"] + HEAD * stature * _unit(p["head"] - shoulders)
    lateral = p["left hip"] - p["right hip"]
    half = PARTS["pelvis"].length * stature / 2 * _unit(lateral)
    parts = {"pelvis": (hips - half, hips + half)}
    for name, (a, b) in SPINE.items():
        parts[name] = hips + a * (shoulders - hips), hips + b * (shoulders - hips)
    parts["neck"] = neck, p["head"]
    parts["head"] = crown - 0.2 * (crown - p["head"]), crown + 0.2 * (crown - p["head"])
    for s in SIDES:
        parts[f"{s} thigh"] = p[f"{s} hip"], p[f"{s} knee"]
        parts[f"{s} shank"] = p[f"{s} knee"], p[f"{s} ankle"]
        parts[f"{s} foot"] = p[f"{s} ankle"], _toes(skeleton, at, s, turn, p, stature)
        parts[f"{s} upper arm"] = p[f"{s} shoulder"], p[f"{s} elbow"]
        parts[f"{s} forearm"] = p[f"{s} elbow"], p[f"{s} wrist"]
        hand = HAND * stature * _unit(p[f"{s} wrist"] - p[f"{s} elbow"])
        parts[f"{s} hand"] = p[f"{s} wrist"], p[f"{s} wrist"] + hand
    ends = np.array([parts[name] for name in PARTS]).transpose(2, 0, 1, 3)
    radius = np.array([part.radius for part in PARTS.values()])
    colours = tuple(part.colour for part in PARTS.values())
    return Limbs(tuple(PARTS), ends, radius, colours, lateral, stature)


def _toes(
    skeleton: Skeleton, at: dict[str, int], side: str, turn: Array, p: dict[str, Array],
    stature: float,
) -> Array:  # fmt: skip
    """Where a foot ends: at its toes, or ahead of the ankle where the file has none."""
    row = _find(at, side, TOES)
    if row is not None:
        return np.asarray(skeleton.points[:, row] @ turn.T)
    lateral = _unit(p["left hip"] - p["right hip"])
    ahead = _unit(np.cross(lateral, np.array([0.0, 0.0, 1.0])))
    return np.asarray(p[f"{side} ankle"] + TOE * stature * ahead)


def _bones(skeleton: Skeleton) -> Limbs:
    """One capsule a bone of whatever moves."""
    points = skeleton.points
    extent = np.ptp(points, axis=1).mean(axis=0)
    turn = Z_UP[1 if extent[1] >= extent[2] else 2]
    points = points @ turn.T
    stature = float(np.percentile(np.ptp(points[:, :, 2], axis=1), 95))
    rows, names = [], []
    for i, joint in enumerate(skeleton.joints):
        if (
            joint.parent >= 0
            and _length(points[:, joint.parent], points[:, i]) > SHORTEST * stature
        ):
            rows.append((joint.parent, i))
            names.append(f"{skeleton.joints[joint.parent].name} to {joint.name.removesuffix(END)}")
    names = [f"{name} {i}" for i, name in enumerate(names, 1)]
    ends = points[:, np.array(rows, dtype=np.int64).reshape(-1, 2)]
    low, share, high = SLIM
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2).mean(axis=0) / (stature or 1.0)
    radius = np.clip(share * length, low, high)
    return Limbs(tuple(names), ends, radius, (BONE,) * len(rows), None, stature)


def _upright(up: Array) -> Array:
    """The rotation (3, 3) that turns the coordinate axis nearest to `up` (3,) into z."""
    axis = int(np.argmax(np.abs(up)))
    sign = float(np.sign(up[axis])) or 1.0
    z = sign * np.eye(3)[axis]
    x = np.eye(3)[(axis + 1) % 3] if axis == 2 else np.eye(3)[0 if axis == 1 else 1]
    return np.array([x, np.cross(z, x), z])


def _unit(v: Array) -> Array:
    """(F, 3) of length one; where it has none, ahead."""
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return np.where(length > STEEP, v / np.maximum(length, STEEP), np.array([1.0, 0.0, 0.0]))


def _length(a: Array, b: Array) -> float:
    return float(np.linalg.norm(b - a, axis=1).mean())
