"""Pictures of a study's figures, drawn by matplotlib where it is installed."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from app.errors import StudyError

Line = tuple[Sequence[float], Sequence[float]]


def draw_lines(
    path: Path, panels: Mapping[str, Mapping[str, Line]], across: str, up: str, *, log: bool = False
) -> None:
    """Draw named lines side by side in panels, by title, into `path` (.svg, .png, .pdf).

    across, up: what the axes are, with units. Raises StudyError without matplotlib or a place
    to write to.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as e:
        raise StudyError("plots need matplotlib; install it with: pip install flinch[plots]") from e
    figure = Figure(figsize=(5.0 * len(panels), 4.0), layout="constrained")
    for i, (title, lines) in enumerate(panels.items()):
        axes = figure.add_subplot(1, len(panels), i + 1)
        for name, (x, y) in lines.items():
            axes.plot(x, y, marker="o", label=name)
        if log:
            axes.set_xscale("log")
            axes.set_yscale("log")
        axes.set(title=title, xlabel=across, ylabel=up if i == 0 else "")
        axes.grid(alpha=0.3)
        axes.legend()
    try:
        figure.savefig(path)
    except (OSError, ValueError) as e:
        raise StudyError(f"{path}: cannot be drawn ({e}); give a .svg, .png or .pdf") from e
