"""How legs and arms swing while a person walks.

Angles of hip, knee and ankle in the sagittal plane over one cycle, from one heel strike of a leg
to its next: key values of the curves of Winter, "The Biomechanics and Motor Control of Human
Gait", 2nd edition, 1991, natural cadence, rounded to a degree, joined by a periodic cubic spline.
Steps grow with the speed as their rate does (walk ratio: step length over steps a minute, near
0.0065 m min; Sekiya and Nagasaki, Gait & Posture 7, 1998), and the angles with the steps.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from app.messages import Array, freeze

# percent of the cycle and degrees: flexion of hip and knee, dorsiflexion of the ankle
HIP = [(0, 19), (10, 16), (20, 9), (30, 1), (40, -7), (50, -11), (60, -5), (70, 9), (80, 20),
       (85, 22), (92, 21), (100, 19)]  # fmt: skip
KNEE = [(0, 4), (7, 15), (14, 21), (24, 15), (40, 6), (50, 12), (60, 39), (72, 64), (82, 48),
        (90, 20), (97, 1), (100, 4)]  # fmt: skip
ANKLE = [(0, 0), (7, -4), (14, 0), (30, 7), (44, 10), (52, 6), (64, -20), (74, -8), (84, 1),
         (92, 1), (100, 0)]  # fmt: skip
WALK_RATIO = 0.0065  # m min, of a person of STATURE
STATURE = 1.70  # m
NATURAL = 0.86  # stride of those curves over the stature
STEPS = 256  # of the tables
ARM_SWING = 0.35  # rad to either side at a natural stride; a little more ahead than back


def _table(keys: list[tuple[int, int]]) -> Array:
    at, degrees = np.array(keys, dtype=np.float64).T
    return np.asarray(CubicSpline(at / 100, np.radians(degrees), bc_type="periodic")(_SHARE))


_SHARE = np.arange(STEPS) / STEPS
CYCLE: Array = freeze(np.column_stack([_table(HIP), _table(KNEE), _table(ANKLE)]))  # (STEPS, 3)


def stride(speed: float, stature: float) -> float:
    """Way [m] of a full cycle of both legs, at `speed` [m/s]."""
    ratio = WALK_RATIO * stature / STATURE
    return float(2.0 * np.sqrt(60.0 * speed * ratio))


def swing(share: float) -> Array:
    """Angles (3,) [rad] of hip, knee and ankle at a share of the cycle since the heel struck."""
    at = (share % 1.0) * STEPS
    i = int(at) % STEPS
    before, after = CYCLE[i], CYCLE[(i + 1) % STEPS]
    return np.asarray(before + (at - int(at)) * (after - before))
