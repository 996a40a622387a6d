"""Figures in words: what each is called, in which unit, how it is summed up and shown."""

from typing import NamedTuple

import numpy as np

OVERS = {  # of the trials
    "mean": "mean over the trials",
    "least": "least of all trials",
    "largest": "largest of all trials",
    "sum": "sum over the trials",
}
NOTHING = "\N{EN DASH}"


class Figure(NamedTuple):
    """What is known of a figure.

    unit:   '%' stands for shares, which are shown times 100.
    over:   one of `OVERS`.   better: +1 more is, -1 less is, 0 neither.
    means:  one line for who does not know it.
    """

    label: str
    unit: str = ""
    over: str = "mean"
    better: int = 0
    means: str = ""

    @property
    def scale(self) -> float:
        """What a value is multiplied with to be shown in `unit`."""
        return 100.0 if self.unit == "%" else 1.0

    @property
    def title(self) -> str:
        """The label with its unit."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label

    def show(self, value: float, signed: bool = False) -> str:
        """A value in the unit, without it; a dash for none."""
        if not np.isfinite(value):
            return NOTHING
        x, sign = value * self.scale, "+" if signed else ""
        if self.over == "sum":
            return f"{x:{sign}g}"
        digits = {"m": 3, "rad": 3, "s": 2, "%": 1}.get(self.unit)
        return f"{x:{sign}.3g}" if digits is None else f"{x:{sign}.{digits}f}"


FIGURES = {
    "paper_mean_m": Figure(
        "distance between clouds, mean", "m", better=1,
        means="as in the paper: from the robot's cloud to the cloud that its sensors keep, over "
        "the times at which there is one",
    ),
    "paper_std_m": Figure(
        "distance between clouds, largest deviation", "m", "largest",
        means="the paper's sigma_max: standard deviation over a trial, the largest of all",
    ),
    "paper_share": Figure(
        "time with a distance between clouds", "%", means="else the sensors keep no point at all"
    ),
    "true_mean_m": Figure(
        "true distance, mean", "m", better=1,
        means="between the true surfaces of the arm and of what is near it, which no controller "
        "knows",
    ),
    "true_std_m": Figure("true distance, largest deviation", "m", "largest"),
    "true_p5_m": Figure("true distance, 5th percentile", "m", better=1),
    "true_least_m": Figure("true distance, least", "m", "least", 1),
    "below_kept": Figure(
        "time below the distance kept", "%", better=-1, means="by the true distance"
    ),
    "steady_m": Figure("true distance in the end", "m", better=1),
    "goal_error_m": Figure("goal error", "m", better=-1),
    "goal_error_rad": Figure("goal error, turned", "rad", better=-1),
    "own_mps": Figure(
        "own speed into a contact", "m/s", "largest", -1, "of the arm, towards what it touches"
    ),
    "contacts": Figure("contacts", "", "sum", -1, "how often the true distance comes to zero"),
    "cell_least_m": Figure(
        "least true distance to the known cell", "m", "least", 1, "table, tools, what it works on"
    ),
    "work": Figure(
        "work against undisturbed", "%", better=1,
        means="waypoints a minute, against the same controller with nobody there",
    ),
    "waypoints_per_min": Figure("waypoints a minute", "", better=1),
    "waypoints": Figure("waypoints", "", better=1),
    "path_error_m": Figure("path error", "m", better=-1, means="root mean square of the tool's"),
    "jerk_rms": Figure("jerk of commands", "rad/s³", better=-1, means="root mean square"),
    "jumps_per_s": Figure(
        "jumps of the control point", "1/s", better=-1,
        means="another control point at once, more than 5 cm away",
    ),
    "reaction_s": Figure(
        "reaction time", "s", better=-1,
        means="from the true distance falling below the distance kept to the avoidance acting; "
        "median of a trial",
    ),
    "reactions": Figure(
        "approaches", "", "sum", means="at which the avoidance did not act already"
    ),
    "seen_share": Figure(
        "nearest point seen", "%", better=1,
        means="share of the time in which what is truly nearest is perceived to 10 cm",
    ),
    "avoiding_share": Figure("time in which the avoidance acts", "%"),
    "stops": Figure("stops", "", "sum", -1),
}  # fmt: skip
UNITS = {"_m": "m", "_s": "s", "_rad": "rad", "_share": "%", "_deg": "°"}


def figure_of(key: str) -> Figure:
    """What is known of a figure; of one that nobody has described, what its name says."""
    if key in FIGURES:
        return FIGURES[key]
    for end, unit in UNITS.items():
        if key.endswith(end):
            return Figure(key.removesuffix(end).replace("_", " "), unit)
    return Figure(key.replace("_", " "))


def in_words(text: str) -> str:
    """A check's name with its figures' labels in place of their keys."""
    words = {"low": "lower limit"} | {key: figure.label for key, figure in FIGURES.items()}
    return ", ".join(words.get(part, part) for part in text.split(", "))


def p_words(p: float) -> str:
    """The p of a test."""
    if not np.isfinite(p):
        return NOTHING
    return "p < 0.001" if p < 0.001 else f"p = {p:.2g}"
