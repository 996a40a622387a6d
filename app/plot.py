"""Pictures of a study's figures, drawn by matplotlib where it is installed."""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from itertools import cycle
from pathlib import Path
from typing import Any

from app.errors import ConfigError

KINDS = (".png", ".svg")
COLOURS = ("#00798c", "#d1495b", "#edae49", "#8d96a3", "#66437d", "#5b8c3e")  # in their order
Curve = tuple[Sequence[float], Sequence[float]]


def check_plot(path: Path) -> None:
    """ConfigError, before hours of runs, where the picture could not be drawn."""
    if path.suffix.lower() not in KINDS:
        raise ConfigError(f"plot = {path}; give a file that ends in {' or '.join(KINDS)}")
    if not path.parent.is_dir():
        raise ConfigError(f"plot = {path}: no folder {path.parent}; make it first")
    if find_spec("matplotlib") is None:
        raise ConfigError("plot needs the package matplotlib; install flinch[plot]")


def plot_lines(path: Path, fields: Mapping[str, Mapping[str, Curve]], across: str, up: str) -> None:
    """Named lines over logarithmic axes, a field a title; across, up: what the axes are."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.6 * len(fields), 4.2), layout="constrained")
    for i, (title, lines) in enumerate(fields.items()):
        field = figure.add_subplot(1, len(fields), i + 1)
        for name, (x, y) in lines.items():
            field.plot(x, y, "o-", label=name)
        field.set(title=title, xlabel=across, ylabel=up, xscale="log", yscale="log")
        field.grid(alpha=0.3)
        field.legend(fontsize="small")
    _save(figure, path)


def plot_tradeoff(rows: list[dict[str, Any]], path: Path) -> None:
    """One field a scene; a line joins the points of a controller from near to far."""
    from matplotlib.figure import Figure

    scenes = list(dict.fromkeys(r["scene"] for r in rows))
    figure = Figure(figsize=(4.6 * len(scenes), 4.2), layout="constrained")
    for field, scene in zip(figure.subplots(1, len(scenes), squeeze=False)[0], scenes, strict=True):
        here = [r for r in rows if r["scene"] == scene]
        program = any(r["waypoints_per_min"] > 0.0 for r in here)
        modes = dict.fromkeys(r["mode"] for r in here)
        for colour, mode in zip(cycle(COLOURS), modes, strict=False):
            points = sorted((r for r in here if r["mode"] == mode), key=lambda r: r["kept_m"])
            cost = [r["waypoints_per_min"] if program else 100 * r["goal_error_m"] for r in points]
            clear = [100.0 * (r["distal_p5_m"] if program else r["least_m"]) for r in points]
            field.plot(cost, clear, "o-", color=colour, label=mode)
            for x, y, r in zip(cost, clear, points, strict=True):
                field.annotate(f"{100 * r['kept_m']:g}", (x, y), (4, 4), textcoords="offset points")
        field.set_title(scene)
        field.set_xlabel("waypoints a minute" if program else "goal error [cm], less is better")
        field.set_ylabel(
            f"{'5th percentile from the elbow on' if program else 'least distance'} [cm]"
        )
        field.grid(alpha=0.3)
        field.legend(fontsize="small")
    figure.suptitle("Clearance against the goal; numbers: distance kept [cm]")
    _save(figure, path)


def _save(figure: Any, path: Path) -> None:
    try:
        figure.savefig(path, dpi=150)
    except OSError as e:
        raise ConfigError(f"plot = {path}: cannot be written ({e.strerror}); try another") from e
