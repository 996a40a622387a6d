"""Speed and separation: how fast a body point may approach at a distance. A model only.

The protective separation distance of ISO/TS 15066:2016 with constant deceleration a,

    S = v_h (T + v/a) + v T + v^2 / (2 a) + C

for a person who comes with v_h while the robot approaches with v: T is the reaction time, from
a measurement to the first braking, and C holds intrusion and uncertainties. Solved for v it is
the speed that a distance allows. The sensors are not safety rated and C is far below what the
standards ask of such a detection: this shows and slows, it does not certify.
"""

import numpy as np

from app.config import Params
from app.messages import Array


def protective_distance(v: Array, params: Params, v_h: Array | float | None = None) -> Array:
    """S [m] for approach speeds v [m/s] >= 0 of the robot; v_h defaults to the setting's."""
    person = params.ssm_person if v_h is None else v_h
    T, a = params.ssm_reaction, params.ssm_deceleration
    return np.asarray(person * (T + v / a) + v * T + v * v / (2.0 * a) + params.ssm_margin)


def allowed_speed(distance: Array, params: Params, v_h: Array | float | None = None) -> Array:
    """Largest approach speed [m/s] whose protective distance is not above `distance` [m]."""
    person = params.ssm_person if v_h is None else v_h
    aT, a = params.ssm_deceleration * params.ssm_reaction, params.ssm_deceleration
    root = person**2 + aT * aT + 2.0 * a * (distance - params.ssm_margin)
    return np.maximum(np.sqrt(np.maximum(root, 0.0)) - (person + aT), 0.0)
