"""How a person is built: lengths and thicknesses as shares of the stature.

Lengths: Drillis & Contini, "Body Segment Parameters", Office of Vocational Rehabilitation, 1966,
as in Winter, "Biomechanics and Motor Control of Human Movement", figure 4.1: ankle 0.039, knee
0.285, hip 0.530, shoulder 0.818 of the stature above the floor; upper arm 0.186, forearm 0.146,
hand 0.108, foot 0.152, half of the shoulders' breadth 0.129. The hips' joints lie 0.055 from the
middle. Thicknesses are our own choice, those of a clothed adult of 75 kg at 1.75 m.
"""

from dataclasses import dataclass

import numpy as np

from app.messages import Array, freeze
from app.world.shapes import Shape, capsule

Colour = tuple[int, int, int]
SHORT, TALL, MIDDLE = 1.55, 1.95, 1.75  # m: what seeds draw from, and who has no seed
FLOOR = -0.75  # m, in the base frame with the table top at z = 0
ANKLE, SHANK, THIGH = 0.039, 0.246, 0.245
HIP = (0.055, 0.530)  # to the side, and above the floor
SHOULDER = (0.129, 0.818)
UPPER_ARM, FOREARM, HAND = 0.186, 0.146, 0.090  # the hand's to the end of its axis
HEEL, TOE, SOLE = 0.035, 0.073, 0.017  # of the foot's axis: behind, before and below the ankle
SKIN, SHIRT, TROUSERS = (222, 184, 155), (74, 111, 165), (62, 68, 82)
SHOE = (45, 42, 40)


@dataclass(frozen=True, slots=True)
class Part:
    """One capsule: its radius and its length, as shares of the stature, and its colour."""

    radius: float
    length: float
    colour: Colour


TRUNK: dict[str, tuple[Part, tuple[float, float]]] = {  # and its axis, above the hips
    "abdomen": (Part(0.074, 0.08, SHIRT), (0.05, 0.13)),
    "chest": (Part(0.085, 0.055, SHIRT), (0.15, 0.205)),
    "neck": (Part(0.032, 0.07, SKIN), (0.27, 0.34)),
    "head": (Part(0.058, 0.025, SKIN), (0.387, 0.412)),
}
PELVIS = Part(0.070, 0.06, TROUSERS)
LEG = {
    "thigh": Part(0.047, THIGH, TROUSERS),
    "shank": Part(0.033, SHANK, TROUSERS),
    "foot": Part(0.022, HEEL + TOE, SHOE),
}
ARM = {
    "upper arm": Part(0.028, UPPER_ARM, SHIRT),
    "forearm": Part(0.023, FOREARM, SKIN),
    "hand": Part(0.020, HAND, SKIN),
}
PARTS: dict[str, Part] = (
    {"pelvis": PELVIS}
    | {name: part for name, (part, _) in TRUNK.items()}
    | {f"{side} {name}": part for side in ("left", "right") for name, part in LEG.items()}
    | {f"{side} {name}": part for side in ("left", "right") for name, part in ARM.items()}
)
TRUNK_AXES: Array = freeze(np.array([axis for _, axis in TRUNK.values()]))
LEG_LENGTHS: Array = freeze(np.array([THIGH, SHANK, HEEL, TOE, SOLE, LEG["foot"].radius]))


def shape_of_part(name: str, stature: float) -> Shape:
    """The capsule of a part of a person of `stature` [m]."""
    part = PARTS[name]
    return capsule(stature * part.radius, stature * part.length)
