"""Pictures of coverage: the arm from four sides, and bars of its links."""

from pathlib import Path
from typing import Any

import numpy as np

from app.coverage.tally import WITHIN
from app.plot import COLOURS, save
from app.studies.coverage.study import Found

SIDES = {"front": (15, 0), "left": (15, 90), "back": (15, 180), "above": (80, -90)}
AT = 2  # of `WITHIN`: the gap that the colours show


def draw(found: Found, path: Path) -> None:
    """The last posture's patches, coloured by the share of ways that are seen in time over all
    postures; below, a bar each link and gap."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15.0, 8.4), layout="constrained")
    tally, sums, point = found.tally, found.tally.sums, found.last.at.point
    some = sums.open > 0
    share = sums.seen[AT, some] / sums.open[some]
    grid = figure.add_gridspec(2, len(SIDES), height_ratios=(3, 2))
    for i, (name, (up, round_)) in enumerate(SIDES.items()):
        field: Any = figure.add_subplot(grid[0, i], projection="3d")
        dots = field.scatter(
            *point[some].T, c=share, cmap="RdYlGn", vmin=0.0, vmax=1.0, s=4, linewidths=0
        )
        field.view_init(up, round_)
        field.set_box_aspect(np.ptp(point, axis=0), zoom=1.25)
        field.set_title(name)
        field.set_axis_off()
    figure.colorbar(dots, ax=figure.axes, shrink=0.5, label=_label())
    _bars(figure.add_subplot(grid[1, :]), tally.rows())
    save(figure, path)


def _label() -> str:
    return f"share of ways that are seen {100 * WITHIN[AT]:.0f} cm before contact"


def _bars(field: Any, rows: list[dict[str, Any]]) -> None:
    at = np.arange(len(rows))
    for i, d in enumerate(WITHIN):
        values = [100.0 * r[f"seen_{100 * d:.0f}cm"] for r in rows]
        field.bar(
            at + 0.2 * (i - 1.5), values, 0.2, color=COLOURS[i], label=f"{100 * d:.0f} cm before"
        )
    field.set_xticks(at, [r["name"] for r in rows], fontsize="small")
    field.set(ylabel="of the ways to it, seen [%]", ylim=(0, 100))
    field.grid(alpha=0.3, axis="y")
    field.legend(fontsize="small", ncols=len(WITHIN))
