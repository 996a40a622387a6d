"""The report's pictures: a trial over time, and all trials of a figure side by side."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from app.colours import ALARM, POINT, WARN, css
from app.messages import Array, Verdict
from app.plot import save
from app.studies.bootstrap import bootstrap
from app.studies.report.words import Figure

FAR = 1.0  # [m] up to which distances are drawn
CLOUDS, TRUE, ACTS = css(POINT[Verdict.KEPT]), "#222222", css(WARN)
WIDE, INK = 0.28, "#5b6675"  # half of what a condition's dots take


class Course(NamedTuple):
    """What is drawn of a trial.

    columns: lists over `stamp_s`, see `app.judge.encounter`.   marks: [stamp, words].
    bands:   [m] where the avoidance acts fully and from where on it acts, None: nowhere.
    """

    title: str
    columns: Mapping[str, Sequence[float]]
    marks: Sequence[Sequence[Any]] = ()
    bands: tuple[float, float] | None = None


def draw_course(course: Course, path: Path) -> None:
    """Distances over time above the thresholds, activation below, and when somebody moved."""
    from matplotlib.figure import Figure as Canvas

    canvas = Canvas(figsize=(7.6, 4.8), layout="constrained")
    upper, lower = canvas.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    stamp = np.asarray(course.columns["stamp_s"], dtype=np.float64)
    if course.bands is not None:
        full, begins = course.bands
        upper.axhspan(0.0, full, color=css(ALARM), alpha=0.14, lw=0, label="kept")
        upper.axhspan(full, begins, color=css(WARN), alpha=0.16, lw=0, label="acts within")
    lines = (
        ("paper_m", CLOUDS, 1.4, "between clouds, as in the paper"),
        ("true_m", TRUE, 1.0, "true"),
    )
    for key, colour, width, label in lines:
        y = _finite(course.columns.get(key, []))
        if np.isfinite(y).any():
            upper.plot(stamp, y, color=colour, lw=width, label=label)
    upper.set(ylim=(0.0, FAR), ylabel="distance [m]")
    upper.legend(fontsize="x-small", loc="upper right", ncols=4, framealpha=0.85)
    canvas.suptitle(course.title, fontsize="medium", x=0.01, ha="left")
    activation = _finite(course.columns.get("activation", []))
    if len(activation):
        lower.fill_between(stamp, activation, color=ACTS, alpha=0.5, lw=0)
        lower.plot(stamp, activation, color=ACTS, lw=1.0)
    lower.set(ylim=(0.0, 1.05), ylabel="activation", xlabel="time [s]")
    lower.set_xlim(stamp[0], stamp[-1])
    for at, words in course.marks:
        for field in (upper, lower):
            field.axvline(at, color=INK, lw=0.8, ls=(0, (4, 3)))
        upper.annotate(
            str(words), (at, 1.01), xycoords=("data", "axes fraction"), rotation=45,
            rotation_mode="anchor", va="bottom", fontsize=6.5, color=INK,
        )  # fmt: skip
    for field in (upper, lower):
        field.grid(alpha=0.25)
    save(canvas, path)


def draw_together(
    title: str, courses: Mapping[str, Course], colours: Mapping[str, str], path: Path
) -> None:
    """Trials of one seed by condition in one picture: the paper's distance, and the true one."""
    from matplotlib.figure import Figure as Canvas

    canvas = Canvas(figsize=(7.6, 4.6), layout="constrained")
    fields = canvas.subplots(2, 1, sharex=True)
    heads = (("paper_m", "distance between clouds [m]"), ("true_m", "true distance [m]"))
    for field, (key, words) in zip(fields, heads, strict=True):
        for name, course in courses.items():
            y = _finite(course.columns.get(key, []))
            if np.isfinite(y).any():
                field.plot(course.columns["stamp_s"], y, color=colours[name], lw=1.2, label=name)
        field.set(ylim=(0.0, FAR), ylabel=words)
        field.yaxis.label.set_size("small")
        field.grid(alpha=0.25)
    fields[0].set_title(title, fontsize="medium", loc="left")
    fields[1].legend(fontsize="x-small", loc="upper right", ncols=6, framealpha=0.85)
    fields[1].set_xlabel("time [s]")
    save(canvas, path)


class Strip(NamedTuple):
    """One figure of all trials: values by condition and seed; what others published."""

    figure: Figure
    values: Mapping[str, Mapping[int, float]]
    colours: Mapping[str, str]
    paper: Mapping[str, float] = {}


def draw_strips(strips: Sequence[Strip], path: Path) -> None:
    """A field a figure: a dot a trial, mean and 95 % interval, and the paper's value."""
    from matplotlib.figure import Figure as Canvas

    across = min(2 if len(strips) < 5 else 3 if len(strips) < 7 else 4, len(strips))
    down = -(-len(strips) // across)
    canvas = Canvas(figsize=(11.4, 2.9 * down), layout="constrained")
    fields = canvas.subplots(down, across, squeeze=False).ravel()
    for field, strip in zip(fields, strips, strict=False):
        _strip(field, strip)
    for field in fields[len(strips) :]:
        field.set_axis_off()
    save(canvas, path)


def _strip(field: Any, strip: Strip) -> None:
    scale, names = strip.figure.scale, list(strip.values)
    for x, (name, by_seed) in enumerate(strip.values.items()):
        colour = strip.colours[name]
        y = scale * np.array(list(by_seed.values()))
        if len(y):
            aside = np.linspace(-0.6 * WIDE, 0.6 * WIDE, len(y)) if len(y) > 1 else np.zeros(1)
            field.plot(x + aside, y, "o", color=colour, ms=4, alpha=0.6, mew=0)
            mean, low, high = bootstrap(y.tolist())
            field.plot([x - WIDE, x + WIDE], [mean, mean], color=colour, lw=2.2)
            if len(y) > 1:
                field.plot([x, x], [low, high], color=colour, lw=1.4)
        if name in strip.paper:
            at = scale * strip.paper[name]
            field.plot(x + WIDE + 0.12, at, "D", mfc="white", mec=css(ALARM), mew=1.4, ms=6)
    field.set_title(strip.figure.title, fontsize="small", loc="left")
    # what is changed goes to lines of its own, or long names would lie over each other
    words = [name.replace("+", "\n+").replace("@", "\n@") for name in names]
    turned = max(map(len, names)) > 7 or len(names) > 5
    more = {"rotation": 35, "ha": "right", "rotation_mode": "anchor"} if turned else {}
    field.set_xticks(range(len(names)), words, fontsize="x-small" if turned else "small", **more)
    field.set_xlim(-0.6, len(names) - 0.3)
    field.grid(alpha=0.25, axis="y")


def _finite(values: Sequence[float]) -> Array:
    """Gaps where there is no distance."""
    y = np.asarray(values, dtype=np.float64)
    out: Array = np.where(np.isfinite(y), y, np.nan)
    return out
