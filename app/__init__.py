"""Flinch: a partly sensorised robot arm that gives way with all of its body.

A tick walks once through the rooms: sense, place, clean, measure, decide, move.
Between rooms travel only frozen values (`app.messages`); whoever watches sees snapshots.

For others `__all__` is what there is, each name at this one path; all else may change. A name is
loaded when it is first asked for: importing the package takes no time.
"""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"
__all__ = [
    "Command",
    "FlinchError",
    "Guard",
    "JointSpeeds",
    "JointState",
    "Params",
    "Pose",
    "SensorFrame",
    "Twist",
]
_PLACES = {
    "Command": "reflex", "Guard": "reflex", "JointSpeeds": "reflex", "Pose": "reflex",
    "Twist": "reflex", "FlinchError": "errors", "JointState": "messages",
    "SensorFrame": "messages", "Params": "config",
    "main": "start",  # the command line's, not for others
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """A public name, from the room where it is made."""
    if name not in _PLACES:
        raise AttributeError(f"flinch has no {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
