"""One trial of the benchmark: a scene or an experiment's case, and a guest that fails is named."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from app.control.guests.files import is_guest, tells_row
from app.errors import FlinchError, StudyError
from app.messages import Mode, Snapshot
from app.runtime import Engine
from app.studies.case import Case, Watcher, run_case, setup_of
from app.studies.conditions import Condition, read_condition
from app.studies.experiment import experiment_of
from app.studies.trial import TrialResult, TrialSpec

SCENE = "scene"  # an experiment 'scene:NAME' is nothing but that scene


class Attempt(NamedTuple):
    """A condition, and the case that it is tried in."""

    condition: Condition
    case: Case


def condition_of(spec: TrialSpec) -> Condition:
    """ConfigError for a condition, or an experiment, that there is not."""
    kind, _, _ = spec.experiment.partition(":")
    if kind == SCENE:
        return read_condition(spec.condition, sides=False)
    return experiment_of(spec.experiment).read(spec.condition)


def attempt_of(spec: TrialSpec) -> Attempt:
    """What a trial is made of."""
    condition, (kind, _, scene) = condition_of(spec), spec.experiment.partition(":")
    if kind == SCENE:
        return Attempt(condition, Case(setup_of(spec, condition, scene), condition.params()))
    case = experiment_of(spec.experiment).case
    if case is None:
        raise StudyError(f"the experiment {spec.experiment!r} cannot stand in the benchmark's list")
    return Attempt(condition, case(spec, condition))


def attempted(spec: TrialSpec) -> TrialResult:
    """The trial of a specification, in whatever process; one that dies is one with its cause."""
    try:
        condition, case = attempt_of(spec)
        guest = condition.mode if is_guest(condition.mode) else ""
        result = run_case(spec, condition, case._replace(watch=partial(_Watch, case, guest)))
        if guest and not tells_row(guest):
            result.figures["jumps_per_s"] = np.nan  # nobody knows what it acts on
    except FlinchError as error:
        result = TrialResult(spec.seed, spec.condition, fault=str(error))
    except Exception as error:
        result = TrialResult(spec.seed, spec.condition, fault=f"the trial died: {error!r}")
    return result


class _Watch:
    """The case's own watcher; and it ends the trial of a guest that has failed."""

    def __init__(self, case: Case, guest: str, engine: Engine) -> None:
        self._own: Watcher | None = case.watch(engine) if case.watch else None
        self._guest = guest

    def update(self, s: Snapshot) -> None:
        reason = s.status.reason
        if self._guest and s.status.mode is Mode.STOPPED and reason.startswith(self._guest):
            raise StudyError(f"{reason}, at {s.stamp:.2f} s")
        if self._own is not None:
            self._own.update(s)

    def figures(self) -> dict[str, Any]:
        return {} if self._own is None else self._own.figures()

    def marks(self) -> list[list[Any]]:
        return [] if self._own is None else self._own.marks()
