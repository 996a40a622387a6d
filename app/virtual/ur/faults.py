"""Faults to inject, in words: `drop@5:2 protective@8 local`.

drop@T[:S]      every connection is cut T seconds after a client first moves the arm, and
                refused for S seconds (1)
mute@T[:S]      nothing is sent and nothing is heard from then on, with the connections open
stall@T[:S]     what either side says is held up, and comes all at once S seconds later
corrupt@T[:S]   states are sent as bytes that are no RTDE
silent@T[:S]    every connection is cut; new ones are answered their RTDE version and no more
protective@T    protective stop;   emergency@T   emergency stop
slider@T:F      the pendant's speed slider is set to F, 0 to 1
reduced@T       the safety system changes to its reduced mode
local           the robot is not in remote control, from the start
off             the arm is switched off, from the start
silent          as silent@T, from the start and for ever
cb3             an older controller, PolyScope 3: no remote control, 125 states a second
polyscopex      a newer one, PolyScope X: no dashboard
"""

from dataclasses import dataclass

from app.errors import ConfigError, options

LINKS = ("drop", "mute", "stall", "corrupt", "silent")
STOPS = ("protective", "emergency", "slider", "reduced")
LASTING = ("local", "off", "silent", "cb3", "polyscopex")
KINDS = tuple(dict.fromkeys(LINKS + STOPS + LASTING))
LENGTH = 1.0  # [s] of what is done to the link without one


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault: when it begins [s after the first motion; None = from the start], and how long
    it lasts [s], or for a slider where it is set, 0 to 1."""

    kind: str
    at: float | None = None
    value: float = LENGTH


def parse_fault(text: str) -> Fault:
    """A fault from its words; ConfigError names what is possible."""
    kind, at, rest = text.partition("@")
    if kind not in KINDS:
        raise ConfigError(f"no fault {kind!r}; {options(kind, KINDS)}")
    if not at and kind in LASTING:
        return Fault(kind)
    when, colon, value = rest.partition(":")
    try:
        fault = Fault(kind, float(when), float(value) if colon else LENGTH)
    except ValueError:
        fault = None
    if fault is None or kind not in LINKS + STOPS or not _sensible(fault):
        raise ConfigError(
            f"fault {text!r}; write it as drop@5, drop@5:2, protective@8, slider@5:0.3 or local"
        )
    return fault


def _sensible(fault: Fault) -> bool:
    if fault.at is None or not 0.0 <= fault.at < 1e6:
        return False
    return 0.0 <= fault.value <= 1.0 if fault.kind == "slider" else 0.0 < fault.value < 1e6
