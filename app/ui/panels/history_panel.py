"""The plots of a recording: two minutes around the moment that is shown, and that moment.

What the survey has not reached yet is empty, and fills while one looks.
"""

import numpy as np
import viser
from viser import uplot

from app.messages import Array, Snapshot, Verdict
from app.replay.open_loop import HORIZON
from app.replay.player import Player
from app.replay.survey import Survey
from app.timing import Clock
from app.ui.colours import ALARM, DARK, GHOST, POINT, RGB, css
from app.ui.pacing import Every
from app.ui.panels.plot_panel import AXIS, CEILING, TIME

SENT = 0.2  # [s] between two pictures
SPAN = 120.0  # [s] of the recording in one picture
MOST = 600  # samples in a picture; more are not told apart
BELOW = -10.0  # [cm] out of sight
FASTEST = 2.0  # [rad/s] larger norms of a command are drawn at the top


class HistoryPanel:
    """Three charts: distance, the command's norm, the activation.

    With a ghost its curves stand beside the recorded ones; the distance is then the one that each
    command would come to.
    """

    def __init__(
        self, server: viser.ViserServer, player: Player, survey: Survey, clock: Clock
    ) -> None:
        self._survey, self._clock, self._pace = survey, clock, Every(SENT)
        self._began, self._here = float(player.times[0]), 0.0
        self._gui = server.gui
        both = [("recorded", POINT[Verdict.KEPT]), ("ghost", GHOST)][: 1 + survey.ghostly]
        near = f"Closest if the command went on for {HORIZON:g} s [cm]"
        self.distance = self._chart(
            near if survey.ghostly else "Smallest distance [cm]",
            [*both, ("kept", ALARM)], 1.1 * CEILING, 135,
        )  # fmt: skip
        self.speed = self._chart("Norm of the command [rad/s]", both, 1.05 * FASTEST, 90)
        self.activation = self._chart("Activation of the avoidance, 0 to 1", both, 1.1, 80)

    def update(self, snapshot: Snapshot) -> None:
        self._here = snapshot.stamp - self._began
        self.refresh()

    def refresh(self) -> None:
        """Show what the survey has found since, also while the recording stands still."""
        if not self._pace.due(self._clock.now()):
            return
        s = self._survey
        ghost = s.ghostly
        distance, speed, activation = (
            [s.column(name) for name in names[: 1 + ghost]]
            for names in (
                ("ahead" if ghost else "distance", "ghost_ahead"),
                ("speed", "ghost_speed"),
                ("activation", "ghost_activation"),
            )
        )
        centimetres = [100.0 * c for c in (*distance, s.column("kept"))]
        self._show(self.distance, centimetres, CEILING)
        self._show(self.speed, speed, FASTEST)
        self._show(self.activation, activation, 1.0)

    def _chart(
        self, title: str, curves: list[tuple[str, RGB]], top: float, height: int
    ) -> viser.GuiUplotHandle:
        x = np.linspace(0.0, 1.0, 5)
        lines = [uplot.Series(label=n, stroke=css(c), width=1.5) for n, c in curves]
        cursor = uplot.Series(label="here", stroke=css(DARK), width=1.5)
        low, high = self._window()
        return self._gui.add_uplot(
            (x, *(np.full(5, np.nan) for _ in range(len(lines) + 1))),
            (uplot.Series(label="s"), *lines, cursor),
            title=title,
            scales={
                "x": {"time": False, "range": (low, high)},
                "y": {"range": (0.0, top)},
            },
            axes=(uplot.Axis(**TIME), uplot.Axis(**AXIS)),  # type: ignore[typeddict-item]
            legend=uplot.Legend(show=False),
            height=height,
        )

    def _window(self) -> tuple[float, float]:
        """[s] what is shown: all of a short recording, else a stretch that only turns over."""
        end = max(float(self._survey.time[-1]), 0.1)
        if end <= SPAN:
            return 0.0, end
        page = np.floor(self._here / SPAN)
        return float(page * SPAN), float((page + 1.0) * SPAN)

    def _show(self, chart: viser.GuiUplotHandle, curves: list[Array], top: float) -> None:
        """Curves, and an upright line at the moment that is shown."""
        low, high = self._window()
        inside = np.flatnonzero((self._survey.time >= low) & (self._survey.time <= high))
        rows = inside[:: max(1, -(-len(inside) // MOST))]
        x, here = self._survey.time[rows], self._here
        at = int(np.searchsorted(x, here))
        data = [with_gap(np.minimum(c[rows], top), at) for c in curves]
        line = np.insert(np.full(len(x), np.nan), at, [BELOW, 2.0 * top, np.nan])
        if chart.scales is not None and chart.scales["x"].get("range") != (low, high):
            chart.scales = {**chart.scales, "x": {"time": False, "range": (low, high)}}
        chart.data = (np.insert(x, at, [here] * 3), *data, line)


def with_gap(curve: Array, at: int) -> Array:
    """`curve` with three samples of its own before row `at`, so that it is not broken there."""
    around = curve[max(at - 1, 0) : at + 1]
    value = around.mean() if len(around) else np.nan
    return np.insert(curve, at, [value] * 3)
