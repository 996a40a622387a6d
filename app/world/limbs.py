"""Legs and arms of a walking person, in the walker's frame: x ahead, y to the left, z up.

A limb is the two ends of a capsule's axis, (2, 3) [m]; an arm is two limbs, upper arm and
forearm with hand, (2, 2, 3). `side` is +1 for the left and -1 for the right.
"""

import numpy as np

from app.compiled import compiled
from app.messages import Array

HIP = (0.09, -0.10)  # m, to the side and up
LEG = 0.57  # m between the ends of its axis; the sole touches the floor at z = -0.75 m
SHOULDER = (0.22, 0.40)  # m, to the side and up
UPPER_ARM, FOREARM = 0.28, 0.38  # m from joint to joint, and to the tip of the hand
ELBOW_BEND = 0.25  # rad, of a hanging arm
LEAST = 0.15  # m from shoulder to hand
BACK = np.array([-1.0, 0.0, -0.2])  # a little down, so that a level reach ahead has an elbow
MOST = 0.997 * (UPPER_ARM + FOREARM)  # m: never quite straight, or the elbow would jump


def leg(side: int, swing: float) -> Array:
    """A leg swung forward by `swing` [rad]."""
    hip = np.array([0.0, side * HIP[0], HIP[1]])
    return np.array([hip, hip + LEG * _forward(swing)])


def hanging_arm(side: int, swing: float) -> Array:
    """An arm that hangs, swung forward by `swing` [rad]."""
    shoulder = np.array([0.0, side * SHOULDER[0], SHOULDER[1]])
    elbow = shoulder + UPPER_ARM * _forward(swing)
    return np.array([[shoulder, elbow], [elbow, elbow + FOREARM * _forward(swing + ELBOW_BEND)]])


def bent_arm(shoulder: Array, hand: Array) -> Array:
    """An arm with its hand at `hand` (3,) [m], or as near as it reaches; its elbow points back."""
    u = hand - shoulder
    distance = float(np.linalg.norm(u))
    u = u / distance
    distance = min(max(distance, LEAST), MOST)
    aside = BACK - (BACK @ u) * u
    aside /= np.linalg.norm(aside)
    c = (UPPER_ARM**2 + distance**2 - FOREARM**2) / (2 * UPPER_ARM * distance)
    elbow = shoulder + UPPER_ARM * (c * u + np.sqrt(1 - c * c) * aside)
    return np.array([[shoulder, elbow], [elbow, shoulder + distance * u]])


@compiled
def capsule_poses(ends: Array) -> Array:
    """Poses (n, 4, 4) of capsules along z whose axes have these ends (n, 2, 3) [m]."""
    T = np.zeros((len(ends), 4, 4))
    for n in range(len(ends)):
        a, b = ends[n, 0], ends[n, 1]
        z = (b - a) / np.sqrt(((b - a) ** 2).sum())
        upright = abs(z[1]) < 0.9  # x is the base's y or x axis, cross z
        x = np.array([z[2], 0.0, -z[0]]) if upright else np.array([0.0, -z[2], z[1]])
        x /= np.sqrt((x**2).sum())
        T[n, :3, 0], T[n, :3, 2], T[n, :3, 3] = x, z, (a + b) / 2.0
        T[n, 0, 1] = z[1] * x[2] - z[2] * x[1]
        T[n, 1, 1] = z[2] * x[0] - z[0] * x[2]
        T[n, 2, 1] = z[0] * x[1] - z[1] * x[0]
        T[n, 3, 3] = 1.0
    return T


def rotated(heading: float) -> Array:
    """Rotation (3, 3) about z by `heading` [rad]."""
    c, s = np.cos(heading), np.sin(heading)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _forward(swing: float) -> Array:
    return np.array([np.sin(swing), 0.0, -np.cos(swing)])
