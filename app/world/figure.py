"""Where the capsules of a person are, from the angles of the joints, in the walker's frame.

x ahead, y to the left, z up, the origin under the hips' middle in the height of the base frame.
Angles turn in the sagittal plane [rad]; a capsule is the two ends of its axis, (2, 3) [m].
"""

from dataclasses import dataclass

import numpy as np

from app.compiled import compiled
from app.messages import Array
from app.world.build import (
    ANKLE,
    FLOOR,
    FOREARM,
    HAND,
    HIP,
    LEG_LENGTHS,
    PELVIS,
    SHOULDER,
    TRUNK_AXES,
    UPPER_ARM,
)
from app.world.limbs import bent_arm

HANGING = 0.25  # rad, bend of the elbow of a hanging arm
FOLD = 1.25  # rad, most that a trunk leans ahead
SQUAT = 1.0  # rad, most that thighs go up; knees bend twice as far
SHIFT = 0.3  # of the way that the shoulders go ahead, the hips go back: nobody falls over
REACH = 0.95  # of an arm's length: who reaches bends before the arm is straight
KNEES_TOO = 2.0  # a squat is as much trouble as so much more of a bow
ARM_REACH = UPPER_ARM + FOREARM + HAND
PELVIS_HALF = PELVIS.length / 2


@dataclass(frozen=True, slots=True)
class Stance:
    """Angles [rad] of a body that stands or walks.

    legs: (2, 3) hip, knee and ankle of the left and the right leg.   arms: (2,) swing ahead.
    lean: of the trunk.   squat: of both thighs, beside what they swing.
    """

    legs: Array
    arms: Array
    lean: float = 0.0
    squat: float = 0.0


@compiled
def body_ends(
    stature: float, legs: Array, lean: float, squat: float, trunk: Array, leg: Array
) -> Array:
    """Ends (12, 2, 3) [m] of pelvis, trunk, left and right leg, and the shoulders' joints.

    trunk: `TRUNK_AXES`.   leg: `LEG_LENGTHS`.   The lower foot stands on the floor.
    """
    out = np.zeros((12, 2, 3))
    # whoever bows puts the hips back: the legs lean about the ankles
    back = SHIFT * (SHOULDER[1] - HIP[1]) * np.sin(lean)
    tilt = np.arcsin(min(back / (2.0 * leg[0]), 0.9))
    low = 1e9
    for side in range(2):
        y = HIP[0] if side == 0 else -HIP[0]
        a = legs[side, 0] + squat + tilt
        b = a - legs[side, 1] - 2.0 * squat
        c = legs[side, 0] - legs[side, 1] + legs[side, 2]  # the foot, toes up
        knee = np.array([leg[0] * np.sin(a), y, -leg[0] * np.cos(a)])
        ankle = knee + np.array([leg[1] * np.sin(b), 0.0, -leg[1] * np.cos(b)])
        ahead = np.array([np.cos(c), 0.0, np.sin(c)])
        sole = ankle + leg[4] * np.array([np.sin(c), 0.0, -np.cos(c)])
        row = 5 + 3 * side
        out[row, 0, 1], out[row, 1], out[row + 1, 0], out[row + 1, 1] = y, knee, knee, ankle
        out[row + 2, 0], out[row + 2, 1] = sole - leg[2] * ahead, sole + leg[3] * ahead
        low = min(low, out[row + 2, 0, 2] - leg[5], out[row + 2, 1, 2] - leg[5])
    out[0, :, 2] = 0.01
    out[0, 0, 1], out[0, 1, 1] = -PELVIS_HALF, PELVIS_HALF
    s, c = np.sin(lean), np.cos(lean)
    for i in range(4):
        for end in range(2):
            out[1 + i, end] = np.array([s * trunk[i, end], 0.0, c * trunk[i, end]])
    up = SHOULDER[1] - HIP[1]
    out[11, 0] = np.array([s * up, SHOULDER[0], c * up])
    out[11, 1] = np.array([s * up, -SHOULDER[0], c * up])
    # standing, the ankles stay where they are
    stays = 2.0 * leg[0] * np.sin(tilt) * np.cos(squat)
    out[:, :, 0] -= stays
    out[:, :, 2] -= low
    out *= stature
    out[:, :, 2] += FLOOR
    return out


def figure(stance: Stance, stature: float, hand: int = 0, target: Array | None = None) -> Array:
    """Ends (17, 2, 3) [m] of all parts, in the order of `build.PARTS`.

    hand: which one is at `target` (3,) [m], 0 left, 1 right, or as near as it comes; None: both
    hang.
    """
    body = body_ends(stature, stance.legs, stance.lean, stance.squat, TRUNK_AXES, LEG_LENGTHS)
    arms = [
        hanging_arm(body[11, i], stance.arms[i], stature)
        if target is None or i != hand
        else bent_arm(body[11, i], target, *arm_lengths(stature))
        for i in (0, 1)
    ]
    return np.concatenate([body[:11], *(_with_hand(arm) for arm in arms)])


def hanging_hand(stance: Stance, stature: float, hand: int) -> Array:
    """(3,) [m] where the end of a hand's axis is while both hang: of `figure`, that alone."""
    body = body_ends(stature, stance.legs, stance.lean, stance.squat, TRUNK_AXES, LEG_LENGTHS)
    end: Array = hanging_arm(body[11, hand], stance.arms[hand], stature)[1, 1]
    return end


def arm_lengths(stature: float) -> tuple[float, float]:
    """[m] from shoulder to elbow, and from there to the end of the hand's axis."""
    return stature * UPPER_ARM, stature * (FOREARM + HAND)


def hanging_arm(shoulder: Array, swing: float, stature: float) -> Array:
    """Upper arm and forearm with hand, (2, 2, 3) [m], swung ahead by `swing` [rad]."""
    upper, fore = arm_lengths(stature)
    elbow = shoulder + upper * _ahead(swing)
    return np.array([[shoulder, elbow], [elbow, elbow + fore * _ahead(swing + HANGING)]])


def bow(target: Array, hand: int, stature: float) -> tuple[float, float]:
    """The least lean and squat [rad] from which a hand reaches `target` (3,) [m].

    The one that comes nearest if none reaches.
    """
    lean = np.linspace(0.0, FOLD, 26)[:, None]
    squat = np.linspace(0.0, SQUAT, 21)[None, :]
    up = SHOULDER[1] - HIP[1]
    hips = ANKLE + LEG_LENGTHS[:2].sum() * np.cos(squat)
    x = stature * ((1.0 - SHIFT) * up * np.sin(lean) + 0.0 * squat)
    z = stature * (hips + up * np.cos(lean)) + FLOOR
    y = stature * SHOULDER[0] * (1 - 2 * hand)
    away = np.sqrt((target[0] - x) ** 2 + (target[1] - y) ** 2 + (target[2] - z) ** 2)
    short = np.maximum(away - REACH * ARM_REACH * stature, 0.0)
    trouble = 1e3 * short + lean + KNEES_TOO * squat
    i, j = divmod(int(np.argmin(trouble)), squat.size)
    return float(lean[i, 0]), float(squat[0, j])


def _with_hand(arm: Array) -> Array:
    """Upper arm, forearm and hand, (3, 2, 3), of upper arm and forearm with hand."""
    wrist = arm[1, 0] + (arm[1, 1] - arm[1, 0]) * (FOREARM / (FOREARM + HAND))
    return np.array([arm[0], [arm[1, 0], wrist], [wrist, arm[1, 1]]])


def _ahead(swing: float) -> Array:
    return np.array([np.sin(swing), 0.0, -np.cos(swing)])
