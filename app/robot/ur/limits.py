"""How fast a UR is asked to move: our own caps, published, so that a controller plans with them.

The pendant adds its own: a speed slider, and the safety system's reduced mode. Both are told as
a share of the caps (`pace`), of the same packet as the joint state.
"""

import numpy as np

from app.messages import Array, freeze
from app.robot.ur.safety import REDUCED, Report
from app.tick import Limits

SPEED = 0.8  # [rad/s] of the fastest joint; a UR10e's own limits are 2.1 and 3.1
ACCELERATION = 6.0  # [rad/s^2] of the leading joint; the controller takes up to 40
WATCHDOG = 15.0  # [Hz] with fewer commands a second the controller ends the program
LIMITS = Limits(freeze(np.full(6, SPEED)), freeze(np.full(6, ACCELERATION)))

# The limits of reduced mode lie in the installation and are told nowhere. The strictest that are
# common are 250 mm/s at the tool: of the maker's recovery mode, and of ISO 10218-1 where people
# are near. One joint at SPEED moves the tool of a UR10e, which reaches 1.3 m, by 1.04 m/s.
REDUCED_SHARE = 0.24
LIMITED = 0.02  # the controller's own share is told when it is so much below the slider


def pace(report: Report) -> float:
    """0..1 of the caps that the pendant allows now: its speed slider, and reduced mode.

    `speed_scaling` is no part of it: it falls as the arm nears a safety limit and rises as the
    arm slows down, so whoever plans with it swings between the two.
    """
    slider = min(max(report.slider, 0.0), 1.0)
    return slider * (REDUCED_SHARE if report.safety_mode == REDUCED else 1.0)


def slowed(report: Report) -> str:
    """Why the arm is slower than its caps, in words; empty when it is not."""
    words = []
    if report.slider <= 0.0:
        words.append("the pendant's speed slider is at 0 %; raise it to move the arm")
    elif report.slider < 1.0:
        words.append(f"the pendant's speed slider is at {100.0 * report.slider:.0f} %")
    if report.safety_mode == REDUCED:
        words.append(f"reduced mode: the arm keeps to {100.0 * REDUCED_SHARE:.0f} % of its speed")
    if report.playing and report.scaling < report.slider - LIMITED:
        words.append(
            f"the arm's controller slows it to {100.0 * report.scaling:.0f} %, a safety limit is "
            "near"
        )
    return "; ".join(words)


def capped(qd: Array) -> Array:
    """`qd` (6,) [rad/s], slowed as a whole until the fastest joint keeps SPEED: the last guard
    behind whoever plans with `LIMITS`."""
    fastest = np.abs(qd).max()
    return np.array(qd * min(1.0, SPEED / fastest) if fastest > 0.0 else qd)
