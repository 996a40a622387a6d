"""Arms that reach, and capsules between two points."""

import numpy as np

from app.compiled import compiled
from app.messages import Array

LEAST = 0.15  # m from shoulder to hand
BACK = np.array([-0.6, 0.0, -0.8])  # and down: only who reaches far up ahead has no such side
MOST = 0.997  # of its length: an arm is never quite straight, or the elbow would jump


def bent_arm(shoulder: Array, hand: Array, upper: float, fore: float) -> Array:
    """Upper arm and forearm with hand as the ends of their axes, (2, 2, 3) [m].

    The hand is at `hand` (3,), or as near as it reaches; the elbow points back and down.
    upper, fore: [m] from shoulder to elbow, and from there to the end of the hand.
    """
    u = hand - shoulder
    distance = float(np.linalg.norm(u))
    u = u / distance
    distance = min(max(distance, LEAST), MOST * (upper + fore))
    aside = BACK - (BACK @ u) * u
    aside /= np.linalg.norm(aside)
    c = (upper**2 + distance**2 - fore**2) / (2 * upper * distance)
    elbow = shoulder + upper * (c * u + np.sqrt(1 - c * c) * aside)
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
