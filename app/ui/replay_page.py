"""The page of a recording: what the live page shows, and nothing that could ask for anything.

The same views on the same pump; in the place of Run, Hold and Stop there are Play and a bar to
scrub with (`app.ui.panels.replay_panel`), and the plots know the whole recording at once.
"""

from html import escape
from types import TracebackType
from typing import Protocol, Self

import viser

from app.assets import asset_folder
from app.record.recording import Recording
from app.replay.open_loop import HORIZON, OpenLoop
from app.replay.player import Player
from app.replay.survey import Survey
from app.timing import Clock, WallClock
from app.ui.access import Access
from app.ui.chosen import Chosen
from app.ui.colours import GHOST, GREY, css
from app.ui.gate import Gate
from app.ui.pacing import Every
from app.ui.panels.blind_panel import show_blind
from app.ui.panels.health_panel import HealthPanel
from app.ui.panels.history_panel import HistoryPanel
from app.ui.panels.recording_panel import RecordingPanel
from app.ui.panels.replay_panel import SPEEDS, ReplayPanel
from app.ui.panels.settings_panel import SettingsPanel
from app.ui.panels.skin_panel import SkinPanel
from app.ui.panels.view_panel import ViewPanel
from app.ui.pump import Pump, View
from app.ui.reading import Reading
from app.ui.roles import Roles
from app.ui.scene.blind_view import BlindView
from app.ui.scene.cell_view import CellView
from app.ui.scene.chosen_view import ChosenView, listen_to_clicks
from app.ui.scene.cloud_view import CloudView
from app.ui.scene.coverage_view import CoverageView
from app.ui.scene.ghost_view import GhostView
from app.ui.scene.goal_view import RecordedGoalView
from app.ui.scene.memory_view import MemoryView
from app.ui.scene.pair_view import PairView
from app.ui.scene.robot_view import RobotView
from app.ui.scene.separation_view import SeparationView
from app.ui.scene.stage import Stage
from app.ui.scene.switch import Switch
from app.ui.scene.world_view import WorldView
from app.ui.server import close_page, open_page, page_url
from app.ui.traffic import Traffic


class Switched(View, Protocol):
    """A view that can be switched off."""

    def switches(self) -> list[Switch]: ...


BANNER = "Recorded: nothing here moves an arm"


class ReplayPage:
    """Built at once, shown from `start` to `stop`; a context manager does both.

    Raises `ServerError` when the port is taken.
    """

    def __init__(
        self, player: Player, survey: Survey, host: str = "127.0.0.1", port: int = 8080,
        clock: Clock | None = None, token: str = "", origins: tuple[str, ...] = (),
    ) -> None:  # fmt: skip
        """The way in, as `app.ui.entrance` has it: an empty token lets every page operate."""
        clock = clock or WallClock()
        self.gate = Gate(Access(token), clock)
        title = f"Flinch · {player.robot.title} · recorded"
        self.server = open_page(host, port, title, self.gate, origins)
        try:
            self._build(player, survey, clock)
        except BaseException:
            close_page(self.server)
            raise

    @property
    def url(self) -> str:
        """The address to open."""
        return page_url(self.server)

    @property
    def fault(self) -> Exception | None:
        """What ended the pump, if anything did."""
        return self.pump.fault

    def start(self) -> None:
        self.pump.start()

    def stop(self) -> None:
        self.pump.stop()
        self.coverage.close()
        close_page(self.server)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def _build(self, player: Player, survey: Survey, clock: Clock) -> None:
        server, gui = self.server, self.server.gui
        recording, traffic = player.timeline.recording, Traffic(server)
        scene = self._scene(player)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(400)
        self.panel = ReplayPanel(server, player, clock, recording.marks, self.reading)
        gui.add_html(banner_html(recording, player.timeline.mind.ghost))
        self._add_speed(player)
        show_blind(server, player)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Recording"):
            self.facts = RecordingPanel(server, player, survey, clock)
        with tabs.add_tab("View"):
            self.coverage = CoverageView(server, player)
            scene = (*scene, self.coverage)
            switches = [switch for view in scene for switch in view.switches()]
            self.switches = ViewPanel(server, switches)
        listen_to_clicks(server, player, self.chosen, self.cloud, self.coverage)
        with tabs.add_tab("Settings"):
            self.settings = SettingsPanel(server)
        with tabs.add_tab("Skin"):
            self.skin = SkinPanel(server, player, self.chosen, recorded=True)
            with gui.add_folder("How well it ran", expand_by_default=False):
                self.health = HealthPanel(server, player, traffic)
        with tabs.add_tab("Help"):
            help_text = asset_folder("static_assets") / "help_replay.md"
            gui.add_markdown(help_text.read_text("utf-8"))
        charts = gui.add_panel()
        with charts.add_tab("Distance", viser.Icon.CHART_LINE):
            self.plot = HistoryPanel(server, player, survey, clock)
        charts.float(x=12, y=-12, width=340)
        self.roles = Roles(server, self.gate, (), lambda page: None, "the replay")

        views: tuple[View, ...] = (
            self.panel, *scene, self.separation, self.facts, self.settings, self.skin,
            self.health, self.plot, self.roles,
        )  # fmt: skip
        self.panel.paces += [
            p for v in (self.reading, *views) for p in vars(v).values() if isinstance(p, Every)
        ]
        self.pump = Pump(server, player, views, clock, traffic, self._still)

    def _scene(self, player: Player) -> tuple[Switched, ...]:
        """The views of the scene that have switches, in the order of those."""
        server = self.server
        self.stage = Stage(server, player)
        self.robot = RobotView(server, player)
        self.world = WorldView(server, player)
        self.separation = SeparationView(server)
        self.chosen = Chosen(player.skin)
        self.clicked = ChosenView(server, player, self.chosen)
        self.cloud = CloudView(server, player)
        self.reading = Reading(player.robot, stays=0.0)
        return (
            self.robot, GhostView(server, player), self.world, RecordedGoalView(server),
            PairView(server, player, self.reading), self.cloud, MemoryView(server),
            CellView(server, player.cell), self.stage, BlindView(server, player),
            self.clicked,
        )  # fmt: skip

    def _add_speed(self, player: Player) -> None:
        self.speed = self.server.gui.add_dropdown(
            "Speed", tuple(SPEEDS), initial_value="1 x", hint="a slow computer may not keep up"
        )

        @self.speed.on_update
        async def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            player.set_speed(SPEEDS[event.target.value])

    def _still(self, seconds: float) -> None:
        """No other tick is shown: what is being computed goes on all the same."""
        self.panel.silent(seconds)
        self.skin.refresh()
        self.facts.refresh()
        self.plot.refresh()


def banner_html(recording: Recording, ghost: OpenLoop | None) -> str:
    """What this is, above everything else; why it ends early, if it does; who the ghost is."""
    lines = [BANNER]
    if recording.torn:
        lines.append(f"It ends early: {recording.torn}")
    if recording.dropped:
        lines.append(f"{recording.dropped} ticks are missing: after the first gap it is a guess")
    style = (
        "margin:0 4% 0.7em;padding-left:0.5em;font-size:0.85em;line-height:1.4;"
        f"border-left:0.45em solid {css(GREY)}"
    )
    text = "".join(f"<div>{escape(line)}</div>" for line in lines)
    if ghost is not None:
        dot = f'<span style="color:{css(GHOST)}">&#9679;</span>'
        words = f"{ghost.name}: where its command would carry the arm within {HORIZON:g} s"
        text += f"<div>{dot} {escape(words)}, on the same frames (open loop)</div>"
    return f'<div data-recorded="1" style="{style}">{text}</div>'
