"""How a recording begins: all that is needed to make its brain again, beside the Inputs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

from app import __version__
from app.cell.parts import Cell
from app.config import Params
from app.control.programs import Program
from app.messages import Goal, Mode
from app.record.fingerprint import Fingerprint, fingerprint_of
from app.robot.model import Robot
from app.robot.skin import Skin
from app.setup import Setup
from app.state import Room, State
from app.tick import Limits
from app.timing import date_now

FORMAT = 1  # of recordings; another number is another language


@dataclass(frozen=True, eq=False, slots=True)
class Head:
    """What stands at the beginning of every recording.

    format:  of the recording.   flinch: the version that made it.
    limits:  the arm's own.   params, cell, goal, programs, begin: what the brain was born with.
    rate:    [Hz] of ticks.   scene, source: what the page called them.
    began:   [s] since 1970, when the first tick was.
    state:   of the brain before the first tick, where that is not the run's first; else None.
    first_tick: its number.
    """

    format: int
    flinch: str
    setup: Setup
    limits: Limits
    params: Params
    cell: Cell
    goal: Goal | None
    programs: dict[str, Program]
    begin: Mode
    rate: float
    scene: str
    source: str
    fingerprint: Fingerprint
    began: float
    state: bytes | None = None
    first_tick: int = 0

    def beginning(self, tick: int, state: bytes | None, began: float) -> "Head":
        """The same of a recording that begins elsewhere."""
        return replace(self, first_tick=tick, state=state, began=began)


class Born(Protocol):
    """What a brain was born with."""

    @property
    def params(self) -> Params: ...
    @property
    def goal(self) -> Goal | None: ...
    @property
    def programs(self) -> Mapping[str, Program]: ...
    @property
    def begin(self) -> Mode: ...


class Mind(Protocol):
    """What is asked of a brain."""

    robot: Robot
    skin: Skin
    cell: Cell

    @property
    def born(self) -> Born: ...
    def capture(self, room: Room | None = None) -> State: ...
    def written(self, state: State) -> bytes: ...


class Plant(Protocol):
    """What is asked of a plant."""

    name: str
    limits: Limits


class Runs(Protocol):
    """What is asked of an engine."""

    scene: str

    @property
    def brain(self) -> Mind: ...
    @property
    def plant(self) -> Plant: ...


def head_of(setup: Setup, engine: Runs) -> Head:
    """The head of a recording of `engine`, which was built from `setup`, from its first tick on."""
    brain, plant = engine.brain, engine.plant
    born = brain.born
    return Head(
        format=FORMAT, flinch=__version__, setup=setup, limits=plant.limits, params=born.params,
        cell=brain.cell, goal=born.goal, programs=dict(born.programs), begin=born.begin,
        rate=setup.rate, scene=engine.scene, source=plant.name,
        fingerprint=fingerprint_of(brain.robot, brain.skin), began=date_now(),
    )  # fmt: skip
