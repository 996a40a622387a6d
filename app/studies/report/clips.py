"""The worst moments of a study, recorded: a trial is a pure function of its specification, so
that it can be run again, with a recorder, up to where it came nearest."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from app.errors import ConfigError
from app.record.recorder import start_recording
from app.runtime import Engine
from app.studies.case import run_case
from app.studies.conditions import Condition
from app.studies.report.trials import Trials
from app.studies.trial import TrialResult, TrialSpec

BEFORE, AFTER = 4.0, 2.0  # [s] around a moment
BEGUN = 1.0  # [s] before which a trial shows where it begins, not what came of it


class Moment(NamedTuple):
    """When a trial came nearest: [m] true distance, [s] since its beginning."""

    result: TrialResult
    condition: Condition
    distance: float
    at: float


class Clip(NamedTuple):
    """A recording from a trial's beginning on, and which part of it shows the moment [s]."""

    path: Path
    begin: float
    end: float
    words: str

    @property
    def page(self) -> Path:
        """Where it is shown, if it is exported."""
        return self.path.with_suffix(".html")


def record_worst(trials: Trials, folder: Path, count: int) -> Iterator[Clip]:
    """Record the moments of the smallest true distance, one a trial; a clip when it is there.

    What files of the same names held before is gone.
    """
    for rank, moment in enumerate(worst(trials, count), start=1):
        name = re.sub(r"[^\w.+-]", "_", f"{rank}-{moment.result.condition}-{moment.result.seed}")
        yield record(trials, moment, folder / f"{name}.mcap")


def worst(trials: Trials, count: int) -> list[Moment]:
    """The nearest moments of trials beside somebody, the nearest first.

    Whoever perceives otherwise than by the sensors is left out: that is in no recording.
    """
    if trials.kind.case is None:
        return []
    found = []
    for name, results in trials.of.items():
        c = trials.read(name)
        if c is not None and not (c.oracle or c.one_pair):
            found += [m for m in (_moment(r, c) for r in results) if m is not None]
    return sorted(found, key=lambda m: (m.distance, -m.result.figures.get("contacts", 0)))[:count]


def _moment(r: TrialResult, c: Condition) -> Moment | None:
    """When it came nearest; None where nothing ever was near."""
    stamp, true = (np.asarray(r.course.get(k, ()), dtype=np.float64) for k in ("stamp_s", "true_m"))
    begun = np.flatnonzero(np.isfinite(true) & (stamp >= stamp[:1] + BEGUN))
    if not len(begun):
        return None
    i = int(begun[np.argmin(true[begun])])
    return Moment(r, c, float(true[i]), float(stamp[i] - stamp[0]))


def record(trials: Trials, moment: Moment, path: Path) -> Clip:
    """Run the trial again and record it, to a little after the moment."""
    s, r = trials.study, moment.result
    whole = float(trials.study.settings["seconds"])
    begin, end = max(moment.at - BEFORE, 0.0), min(moment.at + AFTER, whole)
    spec = TrialSpec(s.experiment, r.condition, r.seed, end, s.rate, s.world, s.skin)
    assert trials.kind.case is not None
    case = trials.kind.case(spec, moment.condition)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
    except OSError as e:
        raise ConfigError(f"{path}: cannot be written ({e.strerror}); give another folder") from e

    def recorded(engine: Engine) -> None:
        start_recording(engine, case.setup, path, threaded=False, views=False)

    again = run_case(spec, moment.condition, case, recorded)
    words = f"{r.condition}, seed {r.seed}: {moment.distance:.3f} m at {moment.at:.1f} s"
    if r.figures.get("contacts"):
        words += f", {r.figures['contacts']} contacts in the trial"
    if not _same(again, r):
        words += "; not the same run: this machine or this version computes it in another way"
    return Clip(path, begin, end, words)


def _same(again: TrialResult, r: TrialResult) -> bool:
    """Is it the same course, as far as it goes?"""
    n = len(again.course["true_m"])
    return all(again.course[key] == r.course[key][:n] for key in ("true_m", "activation"))
