"""One trial of an experiment: its specification, of which it is a pure function, and its result."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple


class TrialSpec(NamedTuple):
    """What a trial is a pure function of.

    condition: see `app.studies.conditions`.   seconds: of simulated time.   rate: [Hz] of ticks.
    world:     error budget of the simulation, drawn with the seed.
    skin:      a layout's name or path; empty: the robot's own.
    """

    experiment: str
    condition: str
    seed: int
    seconds: float
    rate: float = 125.0
    world: str = "honest"
    skin: str = ""


@dataclass
class TrialResult:
    """What came of a trial, or the cause of its death.

    mode:    the condition, as a `TrialLog` calls it.
    figures: numbers by name, `app.judge.encounter` has most of them.
    course:  what is drawn over time, 15 times a second: lists of equal length by name.
    marks:   [stamp, words] of what happened, such as a person's moves.
    """

    seed: int
    mode: str
    figures: dict[str, Any] = field(default_factory=dict)
    course: dict[str, list[float]] = field(default_factory=dict)
    marks: list[list[Any]] = field(default_factory=list)
    fault: str = ""

    @property
    def condition(self) -> str:
        """By which controller, where, with what changed."""
        return self.mode
