"""Which pictures a report has, drawn into its folder."""

from pathlib import Path
from typing import NamedTuple

from app.control.registry import kind_of
from app.studies.report.drawings import Course, Strip, draw_course, draw_strips
from app.studies.report.trials import Trials
from app.studies.report.words import figure_of


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
        strips.append(Strip(figure_of(key), {n: trials.values(n, key) for n in names}, paper))
    if not strips:
        return []
    path = folder / "trials.png"
    draw_strips(strips, path)
    words = "A dot is a trial, the line their mean, with its interval of 95 %"
    words += "; a diamond is the paper's value." if trials.kind.paper else "."
    return [Picture(path, words)]


def draw_courses(trials: Trials, folder: Path) -> list[Picture]:
    """One trial of each condition over time, all of the same seed if there is one that all have."""
    having = {n: [r for r in rs if r.course.get("stamp_s")] for n, rs in trials.of.items()}
    having = {n: rs for n, rs in having.items() if rs}
    common = set.intersection(*({r.seed for r in rs} for rs in having.values())) if having else ()
    pictures = []
    for i, (name, rs) in enumerate(having.items()):
        chosen = next((r for r in rs if r.seed == min(common)), rs[0]) if common else rs[0]
        words = f"{name}, seed {chosen.seed}"
        path = folder / f"course-{i + 1}.png"
        draw_course(Course(words, chosen.course, chosen.marks, _bands(trials, name)), path)
        pictures.append(Picture(path, words))
    return pictures


def _bands(trials: Trials, name: str) -> tuple[float, float] | None:
    """[m] the distance that its controller keeps, and from which on it acts."""
    c = trials.read(name)
    return None if c is None else kind_of(c.mode).distances(c.params())
