"""Which pictures a report has, drawn into its folder."""

from pathlib import Path
from typing import NamedTuple

from app.control.registry import kind_of
from app.plot import COLOURS
from app.studies.report.drawings import (
    Course,
    Strip,
    draw_course,
    draw_strips,
    draw_together,
)
from app.studies.report.trials import Trials
from app.studies.report.words import figure_of

APART = 12  # conditions of which each has a picture of its own


class Picture(NamedTuple):
    """A file beside the page, and what it shows."""

    path: Path
    words: str


def draw_trials(trials: Trials, folder: Path) -> list[Picture]:
    """All trials of the figures that the experiment is about, in one picture."""
    names = list(trials.of)
    strips = []
    for key in trials.looked_at():
        paper = {n: f[key] for n, f in trials.kind.paper.items() if key in f}
        values = {n: trials.values(n, key) for n in names}
        strips.append(Strip(figure_of(key), values, _colours(trials), paper))
    if not strips:
        return []
    path = folder / "trials.png"
    draw_strips(strips, path)
    words = "A dot is a trial, the line their mean, with its interval of 95 %"
    words += "; a diamond is the paper's value." if trials.kind.paper else "."
    return [Picture(path, words)]


def draw_courses(trials: Trials, folder: Path) -> list[Picture]:
    """One trial of each condition over time, those that may be compared together, then apart.

    All are of the same seed where there is one that all have.
    """
    courses = _courses(trials)
    pictures: list[Picture] = []
    for side in trials.sides():
        here = {name: courses[name] for name in side if name in courses}
        if len(here) > 1:
            words = ", ".join(c.title for c in here.values())
            path = folder / f"together-{len(pictures) + 1}.png"
            draw_together(_place(trials, side[0]) or words, here, _colours(trials), path)
            pictures.append(Picture(path, words))
    if len(courses) <= APART:
        for i, course in enumerate(courses.values(), start=1):
            path = folder / f"course-{i}.png"
            draw_course(course, path)
            pictures.append(Picture(path, course.title))
    return pictures


def _courses(trials: Trials) -> dict[str, Course]:
    """What is drawn of each condition that has a course."""
    having = {n: [r for r in rs if r.course.get("stamp_s")] for n, rs in trials.of.items()}
    having = {n: rs for n, rs in having.items() if rs}
    seeds = [{r.seed for r in rs} for rs in having.values()]
    common = min(set.intersection(*seeds), default=None) if seeds else None
    out = {}
    for name, rs in having.items():
        chosen = next((r for r in rs if r.seed == common), rs[0])
        words = f"{name}, seed {chosen.seed}"
        out[name] = Course(words, chosen.course, chosen.marks, _bands(trials, name))
    return out


def _colours(trials: Trials) -> dict[str, str]:
    """The same place among those that it is compared with, the same colour."""
    return {n: COLOURS[i % len(COLOURS)] for side in trials.sides() for i, n in enumerate(side)}


def _place(trials: Trials, name: str) -> str:
    """What the conditions of one picture have in common."""
    c = trials.read(name)
    return " ".join(filter(None, (c.side, c.variant))) if c is not None else ""


def _bands(trials: Trials, name: str) -> tuple[float, float] | None:
    """[m] the distance that its controller keeps, and from which on it acts."""
    c = trials.read(name)
    return None if c is None else kind_of(c.mode).distances(c.params())
