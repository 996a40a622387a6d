"""The way back in: what a person may ask of the engine, drained at the head of a tick.

Frozen like `app.messages`; the engine checks what they hold when it drains them, since a
browser may send anything.
"""

from dataclasses import dataclass, field
from typing import Any

from app.messages import Array, Mode


@dataclass(frozen=True, eq=False, slots=True)
class SetGoal:
    """Move the goal; the pose is made rigid before use."""

    T_base_tool: Array


@dataclass(frozen=True, slots=True)
class SetParams:
    """Swap some settings: names of `Params` fields to values, checked when drained."""

    changes: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SetMode:
    """Run, hold or stop, asked for by a person."""

    mode: Mode
    reason: str = "asked for by a person"


@dataclass(frozen=True, slots=True)
class AddObstacle:
    """Put a body into the simulated world: `shape` is a table as in a scene file."""

    name: str
    shape: dict[str, Any]
    position: tuple[float, float, float]


@dataclass(frozen=True, eq=False, slots=True)
class MoveObstacle:
    """Put a body of the simulated world elsewhere; a scripted one stops following its script."""

    name: str
    T_base_body: Array


@dataclass(frozen=True, slots=True)
class RemoveObstacle:
    """Take a body out of the simulated world."""

    name: str


@dataclass(frozen=True, slots=True)
class SetPose:
    """A typed goal: place [m] and roll, pitch, yaw [rad] about the base's fixed axes."""

    position: tuple[float, float, float]
    rpy: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class RunProgram:
    """Follow a waypoint program by name; an empty name ends the one that runs."""

    name: str


@dataclass(frozen=True, eq=False, slots=True)
class Place:
    """A taught waypoint: where the tool goes (4, 4) and how long it stays [s]."""

    T_base_tool: Array
    dwell: float = 0.0


@dataclass(frozen=True, slots=True)
class RunTaught:
    """Follow places that a person has taught, in their order; known as a program from then on."""

    name: str
    places: tuple[Place, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Jog:
    """Move the tool as long as these come; the wish lapses by itself (`app.control.jogging`).

    share:       -1..1 of the speeds that are set, along x, y, z and about x, y, z; all 0: let go.
    R_base_axes: (3, 3) whose axes these are; None: the tool's own, which turn with it.
    """

    share: tuple[float, ...]
    R_base_axes: Array | None = None
    reason: str = "moved by a person"


@dataclass(frozen=True, slots=True)
class JogJoints:
    """The same joint by joint: -1..1 of the speeds that are set, (n,)."""

    share: tuple[float, ...]
    reason: str = "moved by a person"


@dataclass(frozen=True, eq=False, slots=True)
class Want:
    """What a program asks for in SI units, as long as these come; one of the three is given.

    T_base_tool: (4, 4) a pose to go to at the speeds that are set.
    twist:       (6,) [m/s, rad/s] of the tool, axes of the base.   qd: (n,) [rad/s].
    """

    T_base_tool: Array | None = None
    twist: Array | None = None
    qd: Array | None = None
    reason: str = "moved by a program"


@dataclass(frozen=True, slots=True)
class GoHome:
    """Make the robot's home posture the goal: the joints go there, not only the tool."""


@dataclass(frozen=True, slots=True)
class LearnBackground:
    """Learn the still world of the next `seconds` as a preview, to be kept or discarded."""

    seconds: float = 3.0


@dataclass(frozen=True, slots=True)
class KeepBackground:
    """Take the preview: what it holds is static from now on and bounds the motion."""


@dataclass(frozen=True, slots=True)
class DiscardBackground:
    """End the learning, or drop its preview; what was known before stays known."""


@dataclass(frozen=True, slots=True)
class ForgetBackground:
    """Forget all that was ever learned."""


@dataclass(frozen=True, slots=True)
class UseSensor:
    """Feed a sensor of a mixed skin, by name, from the real skin or from the simulation."""

    sensor: str
    real: bool


@dataclass(frozen=True, slots=True)
class SpoilSensor:
    """Do to a sensor, by its index, what `app.sensing.spoiled.HOW` names: switch it off, say."""

    sensor: int
    how: str


@dataclass(frozen=True, slots=True)
class SetPerson:
    """Let nobody be in the simulated world, or whom `app.world.people.WHO` names."""

    who: str


@dataclass(frozen=True, slots=True)
class PauseWorld:
    """Let what follows a script in the simulated world stand still, or go on from there."""

    paused: bool


@dataclass(frozen=True, slots=True)
class StepWorld:
    """Let a paused world go on for so long [s]."""

    seconds: float = 0.1


# the brain has no part in these
OF_THE_PLANT = (
    AddObstacle, MoveObstacle, RemoveObstacle, UseSensor, SpoilSensor, SetPerson, PauseWorld,
    StepWorld,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Remark:
    """Tell people of something that happened beside the tick, as after an action of theirs."""

    words: str
    refused: bool = False


Action = (
    SetGoal
    | LearnBackground
    | KeepBackground
    | DiscardBackground
    | ForgetBackground
    | SetPose
    | RunProgram
    | RunTaught
    | Jog
    | JogJoints
    | Want
    | GoHome
    | SetParams
    | SetMode
    | AddObstacle
    | MoveObstacle
    | RemoveObstacle
    | UseSensor
    | SpoilSensor
    | SetPerson
    | PauseWorld
    | StepWorld
    | Remark
)
