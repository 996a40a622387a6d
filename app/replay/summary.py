"""A recording in figures: how it went; beside a ghost's answers on the same frames."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from app.plot import Runs, plot_runs
from app.record.recording import Recording
from app.replay.course import Course, course_of, kinds_of, row_of
from app.replay.facts import facts
from app.replay.made import mind_of
from app.replay.open_loop import HORIZON
from app.replay.survey import Survey
from app.replay.timeline import Timeline
from app.report import Report

AHEAD = f"Closest if the command went on for {HORIZON:g} s [cm]"
CEILING = 1.0  # [m] farther is drawn at the top


def summary(recording: Recording, plot: Path | None = None) -> Report:
    """Length, distances, stops, and what the head says, without computing anything anew.

    plot: draws distance, command and activation there.
    """
    course = course_of(recording)
    row = row_of("recorded", recording, course) | {"marks": kinds_of(recording)}
    row |= {name.replace(" ", "_"): words for name, words in facts(recording)}
    if plot is not None:
        plot_runs(plot, {"recorded": curves_of(course)}, recording.head.scene)
    return Report("replay", recording.head.setup.seed, [row])


def beside_ghost(
    recording: Recording, changes: Mapping[str, Any], plot: Path | None = None
) -> Report:
    """The recorded commands and the ghost's on the same frames: an open loop.

    Every tick is recomputed by both brains. `ahead` is the distance to what was known at a tick if
    its command went on for `HORIZON`; what really came is the recorded run alone.
    """
    timeline = Timeline(recording, mind_of(recording, changes))
    survey = Survey(timeline)
    timeline.explore()
    ghost = timeline.mind.ghost
    assert ghost is not None, "a ghost is made of changes"
    apart = survey.column("ghost_apart")
    rows = [_row("recorded", survey, ""), _row(ghost.name, survey, "ghost_")]
    rows[1] |= {
        "apart_mean_rad_s": float(apart.mean()),
        "apart_max_rad_s": float(apart.max()),
        "apart_most_at_s": float(survey.time[int(apart.argmax())]),
    }
    if plot is not None:
        runs = {r["name"]: _curves(survey, "ghost_" if i else "") for i, r in enumerate(rows)}
        plot_runs(plot, runs, f"{recording.head.scene}: an open loop on the same frames")
    what = (
        "replay with a ghost on the same frames, an open loop: at every tick it answers from where "
        f"the recorded arm was, and never gets there itself; ahead: if the command went on for "
        f"{HORIZON:g} s"
    )
    return Report(what, recording.head.setup.seed, rows)


def compared(
    a: Recording, b: Recording, names: tuple[str, str], plot: Path | None = None
) -> Report:
    """Two runs, row by row."""
    courses = [course_of(a), course_of(b)]
    rows = [row_of(n, r, c) for n, r, c in zip(names, (a, b), courses, strict=True)]
    if plot is not None:
        runs = {n: curves_of(c) for n, c in zip(names, courses, strict=True)}
        plot_runs(plot, runs, "")
    return Report("compare", a.head.setup.seed, rows)


def curves_of(course: Course) -> Runs:
    """What is drawn of a run."""
    return {
        "Smallest distance [cm]": (course.time, 100.0 * np.minimum(course.distance, CEILING)),
        "Norm of the command [rad/s]": (course.time, np.linalg.norm(course.qd, axis=1)),
        "Activation of the avoidance": (course.time, course.activation),
    }


def _row(name: str, survey: Survey, who: str) -> dict[str, Any]:
    ahead, speed = survey.column(f"{who}ahead"), survey.column(f"{who}speed")
    known, kept = np.isfinite(ahead), survey.column("kept")
    return {
        "name": name,
        "samples": len(survey.time),
        "min_ahead_m": float(ahead.min()),
        "mean_ahead_m": float(ahead[known].mean()) if known.any() else np.inf,
        "ahead_below_kept_share": float((ahead < kept).mean()),
        "command_mean_rad_s": float(speed.mean()),
        "command_max_rad_s": float(speed.max()),
        "avoiding_share": float((survey.column(f"{who}activation") > 0.0).mean()),
    }


def _curves(survey: Survey, who: str) -> Runs:
    return {
        AHEAD: (survey.time, 100.0 * np.minimum(survey.column(f"{who}ahead"), CEILING)),
        "Norm of the command [rad/s]": (survey.time, survey.column(f"{who}speed")),
        "Activation of the avoidance": (survey.time, survey.column(f"{who}activation")),
    }
