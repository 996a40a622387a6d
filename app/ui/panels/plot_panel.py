"""The last half minute: smallest distance, activation, and jumps of the control point."""

from collections import deque

import numpy as np
import viser
from viser import uplot

from app.messages import Array, Snapshot
from app.ui.colours import ALARM, GHOST, GREY, POINT, WARN, Verdict, css
from app.ui.pacing import Every

PERIOD = 0.1  # [s]
SPAN = 30.0  # [s]
CEILING = 100.0  # [cm] farther, or nothing in sight, is drawn at the top
JUMP = 50.0  # [cm] larger jumps are drawn at the top
NOWHERE = -10.0  # [cm] below the chart: there is no such line
LENGTH = int(SPAN / PERIOD)

# time [s], distance, distance kept [cm], activation, the ghost's distance, the separation distance,
# the control point's largest jump [cm]
Row = tuple[float, float, float, float, float, float, float]

AXIS = {"size": 42, "font": "11px sans-serif"}
TIME = {"size": 24, "font": "11px sans-serif"}


class PlotPanel:
    """Three charts of 300 samples."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._pace = Every(PERIOD)
        self._rows: deque[Row] = deque(maxlen=LENGTH)
        empty = tuple(np.zeros(LENGTH) for _ in range(6))
        self._jump = 0.0  # the largest since the last sample
        seconds = {"time": False, "range": (-SPAN, 0.0)}
        self.distance = server.gui.add_uplot(
            (np.linspace(-SPAN, 0.0, LENGTH), *empty[:5]),
            (
                uplot.Series(label="s"),
                uplot.Series(label="distance [cm]", stroke=css(POINT[Verdict.KEPT]), width=2),
                uplot.Series(label="kept [cm]", stroke=css(ALARM), width=1, dash=(6, 4)),
                uplot.Series(label="begins at [cm]", stroke=css(WARN), width=1, dash=(6, 4)),
                uplot.Series(label="ghost [cm]", stroke=css(GHOST), width=1.5),
                uplot.Series(label="separation [cm]", stroke=css(GREY), width=1.5, dash=(2, 3)),
            ),
            title="Smallest distance [cm]",
            scales={"x": seconds, "y": {"range": (0.0, 1.04 * CEILING)}},  # type: ignore[dict-item]
            axes=(uplot.Axis(**TIME), uplot.Axis(**AXIS)),  # type: ignore[typeddict-item]
            legend=uplot.Legend(show=False),
            height=150,
        )
        self.activation = server.gui.add_uplot(
            (np.linspace(-SPAN, 0.0, LENGTH), empty[0]),
            (
                uplot.Series(label="s"),
                uplot.Series(
                    label="activation", stroke=css(ALARM), fill=css(ALARM) + "30", width=1.5
                ),
            ),
            title="Activation of the avoidance, 0 to 1",
            scales={"x": seconds, "y": {"range": (0.0, 1.04)}},  # type: ignore[dict-item]
            axes=(uplot.Axis(**TIME), uplot.Axis(**AXIS)),  # type: ignore[typeddict-item]
            legend=uplot.Legend(show=False),
            height=105,
        )

        self.jump = server.gui.add_uplot(
            (np.linspace(-SPAN, 0.0, LENGTH), empty[0]),
            (
                uplot.Series(label="s"),
                uplot.Series(label="jump [cm]", stroke=css(POINT[Verdict.BEHIND]), width=1.5),
            ),
            title="Largest jump of the control point [cm]",
            scales={"x": seconds, "y": {"range": (0.0, JUMP)}},  # type: ignore[dict-item]
            axes=(uplot.Axis(**TIME), uplot.Axis(**AXIS)),  # type: ignore[typeddict-item]
            legend=uplot.Legend(show=False),
            height=90,
        )

    def update(self, snapshot: Snapshot) -> None:
        self._jump = max(self._jump, min(100.0 * snapshot.jump, JUMP))
        if not self._pace.due(snapshot.stamp):
            return
        params = snapshot.params
        near = min(100.0 * snapshot.pairs.minimum, CEILING)
        if self._rows and self._rows[-1][0] > snapshot.stamp:  # the clock was set back
            self._rows.clear()
        ghost = NOWHERE
        if snapshot.ghost is not None:
            ghost = min(100.0 * snapshot.ghost.distance, CEILING)
        needed = 100.0 * snapshot.command.protective
        kept = params.d_s if params.mode == "qp" else params.d_min
        self._rows.append(
            (
                snapshot.stamp, near, 100.0 * kept, snapshot.command.activation, ghost,
                min(needed, CEILING) if needed > 0.0 else NOWHERE, self._jump,
            )
        )  # fmt: skip
        self._jump = 0.0
        rows = filled(self._rows)
        lower = rows[:, 2]
        width = params.d_inf - params.d_s if params.mode == "qp" else params.delta
        upper = lower + 100.0 * width
        self.distance.data = (rows[:, 0], rows[:, 1], lower, upper, rows[:, 4], rows[:, 5])
        self.activation.data = (rows[:, 0], rows[:, 3])
        self.jump.data = (rows[:, 0], rows[:, 6])


def filled(rows: deque[Row]) -> Array:
    """(LENGTH, 7) rows with times relative to the newest; before the first, the first repeats."""
    a = np.array(rows)
    a[:, 0] -= a[-1, 0]
    return np.concatenate((np.repeat(a[:1], LENGTH - len(a), axis=0), a))
