"""What a UR says of itself, in words with their remedies.

The numbers are those of the maker's RTDE guide. A pure function of them, so that every state
can be shown without a robot.
"""

from dataclasses import dataclass

RUNNING = 7  # robot_mode in which the arm can move
NORMAL, REDUCED = 1, 2  # safety modes in which the arm can move
PLAYING = 2  # runtime_state of a program that runs

_SAFETY = {
    3: "protective stop: look why, then unlock it on the pendant and press Run",
    4: "recovery mode: a safety limit is exceeded; move the arm back with the pendant",
    5: "safeguard stop: close the safeguard, reset it if it asks for that, and press Run",
    6: "emergency stop of the cell: release it, switch the arm on again and press Run",
    7: "emergency stop of the robot: release the button, switch the arm on and press Run",
    8: "safety violation: see the pendant's log, restart the safety system there",
    9: "safety fault: see the pendant's log, restart the safety system there",
    10: "a joint was exchanged: confirm it on the pendant",
    12: "safeguard stop of the automatic mode: close the safeguard and press Run",
    13: "the enabling switch is released: hold it in its middle position",
}
_ROBOT = {
    -1: "the controller does not answer its own pendant: start it again",
    0: "the arm is disconnected from its controller: look at its cable",
    1: "the safety settings wait to be confirmed on the pendant",
    2: "the controller is starting: wait",
    3: "the arm is switched off: switch it on with the pendant",
    4: "the arm is switching on: wait",
    5: "the brakes are closed: release them with the pendant (Start)",
    6: "somebody moves the arm by hand (freedrive): wait until it is let go",
    8: "the controller updates its firmware: wait",
}
_TEACH = 4  # robot_status_bits: the freedrive button is pressed


@dataclass(frozen=True, slots=True)
class Report:
    """The controller's own state at one moment, as its RTDE variables say.

    slider:  target_speed_fraction, 0..1: where the pendant's speed slider stands.
    scaling: speed_scaling, 0..1: how far the controller itself slows a motion.
    """

    robot_mode: int
    safety_mode: int
    status_bits: int
    runtime_state: int
    slider: float = 1.0
    scaling: float = 1.0

    @property
    def playing(self) -> bool:
        """Does a program run?"""
        return self.runtime_state == PLAYING


def trouble(report: Report) -> str:
    """Why the arm cannot be moved, with the remedy; empty when it can."""
    if report.safety_mode not in (NORMAL, REDUCED):
        unknown = f"safety mode {report.safety_mode}: see the pendant"
        return _SAFETY.get(report.safety_mode, unknown)
    if report.robot_mode != RUNNING:
        return _ROBOT.get(report.robot_mode, f"robot mode {report.robot_mode}: see the pendant")
    if report.status_bits & _TEACH:
        return _ROBOT[6]
    return ""
