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
Runs = Mapping[str, tuple[Any, Any]]  # of one run: title of a field to seconds and values


def check_plot(path: Path) -> None:
    """ConfigError, before hours of runs, where the picture could not be drawn."""
    if path.suffix.lower() not in KINDS:
        raise ConfigError(f"plot = {path}; give a file that ends in {' or '.join(KINDS)}")
    if not path.parent.is_dir():
        raise ConfigError(f"plot = {path}: no folder {path.parent}; make it first")
    check_matplotlib("plot")


def check_matplotlib(what: str) -> None:
    """ConfigError where `what` is to be drawn and cannot be."""
    if find_spec("matplotlib") is None:
        raise ConfigError(f"{what} needs the package matplotlib; install flinch[plot]")


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
    save(figure, path)


def plot_runs(path: Path, runs: Mapping[str, Runs], title: str) -> None:
    """Runs by name over the same time, a field below another."""
    from matplotlib.figure import Figure

    titles = list(next(iter(runs.values())))
    figure = Figure(figsize=(9.2, 2.4 * len(titles)), layout="constrained")
    fields = figure.subplots(len(titles), 1, sharex=True, squeeze=False)[:, 0]
    for field, name in zip(fields, titles, strict=True):
        for colour, (run, curves) in zip(cycle(COLOURS), runs.items(), strict=False):
            field.plot(*curves[name], color=colour, lw=1.2, label=run)
        field.set_title(name, fontsize="medium", loc="left")
        field.grid(alpha=0.3)
    fields[0].legend(fontsize="small")
    fields[-1].set_xlabel("time [s]")
    if title:
        figure.suptitle(title)
    save(figure, path)


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
    save(figure, path)


def plot_frontier(rows: list[dict[str, Any]], path: Path) -> None:
    """Obstacles that are kept over returns of the body that pass, a field a distance."""
    from matplotlib.figure import Figure

    fields = [key for key in rows[0] if key.startswith("kept_")]
    figure = Figure(figsize=(4.6 * len(fields), 4.2), layout="constrained")
    for field, key in zip(figure.subplots(1, len(fields), squeeze=False)[0], fields, strict=True):
        for colour, name in zip(COLOURS, dict.fromkeys(r["filter"] for r in rows), strict=False):
            mine = [r for r in rows if r["filter"] == name]
            passed = [max(r["passed"], 1e-6) for r in mine]  # none has no place on such an axis
            field.plot(passed, [100 * r[key] for r in mine], "o-", color=colour, label=name)
        field.set(title=key.removeprefix("kept_").replace("_", " ") + " before the body")
        field.set(xlabel="returns of the body that pass", xscale="log", ylabel="obstacles kept [%]")
        field.grid(alpha=0.3)
        field.legend(fontsize="small")
    save(figure, path)


def plot_ranges(
    rows: list[dict[str, Any]], measured: Sequence[tuple[float, float, float]], path: Path
) -> None:
    """Noise and found share of walls over their distance, error over their angle; measured:
    from, to and standard deviation [m] of the real sensor."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13.8, 4.2), layout="constrained")
    noise, found, angle = figure.subplots(1, 3)
    walls = [r for r in rows if "shade" in r]
    for colour, shade in zip(COLOURS, dict.fromkeys(r["shade"] for r in walls), strict=False):
        mine = [r for r in walls if r["shade"] == shade]
        at = [r["distance_m"] for r in mine]
        some = [(r["distance_m"], r["noise_m"]) for r in mine if r["valid_share"] > 0.2]
        noise.plot(*zip(*some, strict=True), "o-", color=colour, label=f"simulated, {shade}")
        found.plot(at, [100 * r["valid_share"] for r in mine], "o-", color=colour, label=shade)
    for low, high, sigma in measured:
        noise.plot([low, high], [sigma] * 2, "k-", lw=3, label="measured" if low < 0.1 else None)
    recorded = [(r["distance_m"], r["noise_m"]) for r in rows if "recorded" in r]
    if recorded:
        noise.plot(*zip(*recorded, strict=True), "kx", label="recorded, second differences")
    turned = [r for r in rows if "degrees" in r]
    angle.errorbar(
        [r["degrees"] for r in turned], [100 * r["mean_error_share"] for r in turned],
        [100 * r["zone_error_share"] for r in turned], fmt="o-", capsize=4,
    )  # fmt: skip
    noise.set(title="Noise", xlabel="distance [m]", ylabel="sigma [m]", xscale="log", yscale="log")
    found.set(title="Valid measurements", xlabel="distance [m]", ylabel="[%]")
    angle.set(title="Error of the middle zones", xlabel="angle of the wall [degrees]")
    angle.set_ylabel("mean and spread over zones [% of distance]")
    for field in (noise, found, angle):
        field.grid(alpha=0.3)
    noise.legend(fontsize="small")
    found.legend(fontsize="small")
    save(figure, path)


def save(figure: Any, path: Path) -> None:
    """Write a picture; ConfigError where that cannot be done."""
    try:
        figure.savefig(path, dpi=150)
    except OSError as e:
        raise ConfigError(f"plot = {path}: cannot be written ({e.strerror}); try another") from e
