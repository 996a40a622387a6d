"""Speed and separation: how fast a body point may approach at a distance. A model only.

The protective separation distance of ISO/TS 15066:2016 with constant deceleration a,

    S = v_h (T + v/a) + v T + v^2 / (2 a) + C

for a person who comes with v_h while the robot approaches with v: T is the reaction time, from
a measurement to the first braking, and C holds intrusion and uncertainties. Solved for v it is
the speed that a distance allows. The sensors are not safety rated and C is far below what the
standards ask of such a detection: this shows and slows, it does not certify.

v_h is the pace that a person is assumed to come with or, where the setting asks for it, the
measured one and a margin. T grows with the age of what was measured, from `NEW` on; the way that
something has come within it at its measured speed the distances hold already, see
`app.perception.steadying`. What is not known of distances they hold too: C is for intrusion.
"""

import numpy as np

from app.config import Params
from app.messages import Array, Pairs

UNSURE = 0.25  # [m/s] a person may come faster than measured: twice the estimate's deviation
NEW = 0.10  # [s] the reaction time holds a measurement this old: a frame and its processing
LONG = 10.0  # [s] an older measurement says no more than one this old: nothing


def protective_distance(
    v: Array, params: Params, v_h: Array | float | None = None, age: Array | float = 0.0
) -> Array:
    """S [m] for approach speeds v [m/s] >= 0 of the robot and a person's v_h, by default the
    setting's; age [s] of the measurement."""
    person = params.person_speed if v_h is None else v_h
    T, a = reaction(age, params), params.braking
    return np.asarray(person * (T + v / a) + v * T + v * v / (2.0 * a) + params.separation_margin)


def allowed_speed(
    distance: Array, params: Params, v_h: Array | float | None = None, age: Array | float = 0.0
) -> Array:
    """Largest approach speed [m/s] whose protective distance is not above `distance` [m]."""
    person = params.person_speed if v_h is None else v_h
    aT, a = params.braking * reaction(age, params), params.braking
    root = person**2 + aT * aT + 2.0 * a * (distance - params.separation_margin)
    return np.maximum(np.sqrt(np.maximum(root, 0.0)) - (person + aT), 0.0)


def reaction(age: Array | float, params: Params) -> Array:
    """T [s] from the measurement of that age [s] to the first braking."""
    return np.asarray(params.reaction_time + np.clip(np.asarray(age) - NEW, 0.0, LONG))


def person_speed(pairs: Pairs, params: Params) -> Array:
    """v_h (B,) [m/s] of each pair."""
    assumed = np.full(len(pairs.distance), params.person_speed)
    if not params.person_speed_measured or pairs.approach is None:
        return assumed
    return np.asarray(np.minimum(np.maximum(pairs.approach, 0.0) + UNSURE, assumed))


def ages(pairs: Pairs) -> Array:
    """(B,) [s] of each pair; zero where nobody has asked for it."""
    return np.zeros(len(pairs.distance)) if pairs.age is None else pairs.age


def ceiling(pairs: Pairs, params: Params) -> Array:
    """(B,) [m/s] how fast each pair may close."""
    return allowed_speed(pairs.distance, params, person_speed(pairs, params), ages(pairs))


def needed(pairs: Pairs, closing: Array, params: Params) -> float:
    """S [m] of the nearest pair, at the measured speed `closing` (B,) [m/s] of the robot's points
    towards the world; 0 without a pair."""
    i = pairs.closest
    if i < 0:
        return 0.0
    v = np.maximum(closing[i : i + 1], 0.0)
    v_h, age = person_speed(pairs, params)[i], ages(pairs)[i]
    return float(protective_distance(v, params, v_h, age)[0])
