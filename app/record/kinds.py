"""What may be in a recording, and nothing else: the values by name, and what they were called."""

from dataclasses import fields
from enum import Enum
from typing import Any, get_args

from app import actions, config_names
from app.cell.learned import Learned
from app.cell.parts import Box, Cell, HalfSpace
from app.config import Params
from app.control.programs import Program, Waypoint
from app.errors import RecordingError
from app.messages import BodyView, Goal, JointState, Mode, SensorFrame
from app.record.fingerprint import Fingerprint
from app.record.head import Head
from app.record.marks import Mark
from app.record.witness import Witness
from app.robot.tables import Choice
from app.setup import Setup
from app.tick import ArmReport, Inputs, Limits, SourceReport

VALUES: dict[str, type] = {
    kind.__name__: kind
    for kind in (
        Inputs, JointState, ArmReport, SourceReport, SensorFrame, *get_args(actions.Action),
        Head, Setup, Choice, Limits, Params, Cell, Box, HalfSpace, Learned, Goal, Program, Waypoint,
        Fingerprint, Witness, Mark, BodyView, actions.Place,
    )
}  # fmt: skip
CHOICES: dict[str, type[Enum]] = {"Mode": Mode}
NAMES: dict[str, tuple[str, ...]] = {
    name: tuple(f.name for f in fields(kind)) for name, kind in VALUES.items()
}
RENAMED: dict[str, dict[str, str]] = {"Params": config_names.NOW}  # kind: old name, new name


def renamed(kind: str, name: str) -> str:
    """What a field of a recording is called now; RecordingError for one that there is no more."""
    now = RENAMED.get(kind, {}).get(name, name)
    if now in NAMES[kind]:
        return now
    remedy = config_names.moved(name) if kind == "Params" else ""
    remedy = remedy or "it was made by another version of Flinch; replay it with that one"
    raise RecordingError(f"the recording has {kind}.{name}, which is not known here: {remedy}")


def changes_now(changes: dict[str, Any]) -> dict[str, Any]:
    """The settings that a person changed, as they are called now."""
    return {config_names.NOW.get(name, name): value for name, value in changes.items()}
