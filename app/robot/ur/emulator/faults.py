"""Faults to inject, in words: `drop@5:2 protective@8 local`.

drop@T[:S]      every connection is cut T seconds after a client first moves the arm, and
                refused for S seconds (1)
mute@T[:S]      nothing is sent and nothing is heard from then on, with the connections open
protective@T    protective stop;   emergency@T   emergency stop
local           the robot is not in remote control, from the start
off             the arm is switched off, from the start
"""

from dataclasses import dataclass

from app.errors import ConfigError, options

TIMED = ("drop", "mute", "protective", "emergency")
LASTING = ("local", "off")
LENGTH = 1.0  # [s] of a drop or a mute without one


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault: when it begins [s after the first motion], and how long it lasts [s]."""

    kind: str
    at: float = 0.0
    length: float = LENGTH


def parse_fault(text: str) -> Fault:
    """A fault from its words; ConfigError names what is possible."""
    kind, at, rest = text.partition("@")
    if kind in LASTING and not at:
        return Fault(kind)
    if kind not in TIMED + LASTING:
        raise ConfigError(f"no fault {kind!r}; {options(kind, TIMED + LASTING)}")
    when, colon, length = rest.partition(":")
    try:
        fault = Fault(kind, float(when), float(length) if colon else LENGTH)
    except ValueError:
        fault = None
    if fault is None or kind in LASTING or not (0.0 <= fault.at < 1e6 and 0.0 < fault.length < 1e6):
        raise ConfigError(f"fault {text!r}; write it as drop@5, drop@5:2, protective@8 or local")
    return fault
