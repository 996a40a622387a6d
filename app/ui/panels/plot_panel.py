"""The last half minute: smallest distance, activation, and jumps of the control point."""

import numpy as np
import viser
from viser import uplot

from app.control.registry import kind_of
from app.messages import Snapshot, Verdict
from app.ui.colours import ALARM, GHOST, GREY, POINT, WARN, css
from app.ui.pacing import Every

PERIOD = 0.1  # [s] between two samples
SENT = 0.2  # [s] between two pictures of them
SPAN = 30.0  # [s]
CEILING = 100.0  # [cm] farther, or nothing in sight, is drawn at the top
JUMP = 50.0  # [cm] larger jumps are drawn at the top
NOWHERE = -10.0  # [cm] below the chart: there is no such line
LENGTH = int(SPAN / PERIOD)

# columns: time [s]; distance, distance kept, distance from which it acts, the ghost's distance, the
# separation distance [cm]; activation; the control point's largest jump [cm]
COLUMNS = 8

AXIS = {"size": 42, "font": "11px sans-serif"}
TIME = {"size": 24, "font": "11px sans-serif"}


class PlotPanel:
    """Three charts of 300 samples."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._pace, self._sent = Every(PERIOD), Every(SENT)
        self._rows = np.full((LENGTH, COLUMNS), np.nan)  # the newest last
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
            scales={"x": seconds, "y": {"range": (0.0, 1.1 * CEILING)}},  # type: ignore[dict-item]
            axes=(uplot.Axis(**TIME), uplot.Axis(**AXIS)),  # type: ignore[typeddict-item]
            legend=uplot.Legend(show=False),
            height=135,
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
            scales={"x": seconds, "y": {"range": (0.0, 1.1)}},  # type: ignore[dict-item]
            axes=(uplot.Axis(**TIME), uplot.Axis(**AXIS)),  # type: ignore[typeddict-item]
            legend=uplot.Legend(show=False),
            height=90,
        )

        self.jump = server.gui.add_uplot(
            (np.linspace(-SPAN, 0.0, LENGTH), empty[0]),
            (
                uplot.Series(label="s"),
                uplot.Series(label="jump [cm]", stroke=css(POINT[Verdict.BEHIND]), width=1.5),
            ),
            title="Largest jump of the control point [cm]",
            scales={"x": seconds, "y": {"range": (0.0, 1.15 * JUMP)}},  # type: ignore[dict-item]
            axes=(uplot.Axis(**TIME), uplot.Axis(**AXIS)),  # type: ignore[typeddict-item]
            legend=uplot.Legend(show=False),
            height=80,
        )

    def update(self, snapshot: Snapshot) -> None:
        self._jump = max(self._jump, min(100.0 * snapshot.jump, JUMP))
        if not self._pace.due(snapshot.stamp):
            return
        rows, row = self._rows, (*sample(snapshot), self._jump)
        self._jump = 0.0
        if not rows[-1, 0] <= row[0]:  # the first one, or the clock was set back
            rows[:] = row
        rows[:-1] = rows[1:]
        rows[-1] = row
        if self._sent.due(snapshot.stamp):
            time = rows[:, 0] - rows[-1, 0]
            self.distance.data = (time, *(rows[:, k] for k in range(1, 6)))
            self.activation.data = (time, rows[:, 6])
            self.jump.data = (time, rows[:, 7])


def sample(snapshot: Snapshot) -> tuple[float, ...]:
    """All columns but the last."""
    params, needed = snapshot.params, 100.0 * snapshot.command.protective
    distances = kind_of(params.mode).distances(params)
    kept, begins = (NOWHERE, NOWHERE) if distances is None else np.multiply(100.0, distances)
    ghost = snapshot.ghost.distance if snapshot.ghost is not None else None
    return (
        snapshot.stamp,
        min(100.0 * snapshot.pairs.minimum, CEILING),
        float(kept),
        float(begins),
        min(100.0 * ghost, CEILING) if ghost is not None else NOWHERE,
        min(needed, CEILING) if needed > 0.0 else NOWHERE,
        snapshot.command.activation,
    )
