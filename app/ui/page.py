"""The page: every view on one server, fed by one pump."""

from types import TracebackType
from typing import Self

from app.assets import asset_folder
from app.timing import Clock, WallClock
from app.ui.access import Access
from app.ui.chosen import Chosen
from app.ui.desk import Desk
from app.ui.engine import Engine
from app.ui.gate import Gate
from app.ui.panels.arm_panel import ArmPanel
from app.ui.panels.background_panel import BackgroundPanel
from app.ui.panels.blind_panel import show_blind
from app.ui.panels.control_panel import ControlPanel
from app.ui.panels.health_panel import HealthPanel
from app.ui.panels.help_panel import show_help
from app.ui.panels.legend import Legend
from app.ui.panels.move_panel import MovePanel
from app.ui.panels.obstacles_panel import SHAPES, ObstaclesPanel, Shapes
from app.ui.panels.params_panel import ParamsPanel
from app.ui.panels.plot_panel import PlotPanel
from app.ui.panels.record_panel import RecordPanel
from app.ui.panels.skin_panel import SkinPanel
from app.ui.panels.view_panel import ViewPanel
from app.ui.panels.world_panel import WorldPanel
from app.ui.pump import Pump, View
from app.ui.reading import Reading
from app.ui.roles import Roles
from app.ui.scene.blind_view import BlindView
from app.ui.scene.cell_view import CellView
from app.ui.scene.chosen_view import ChosenView, listen_to_clicks
from app.ui.scene.cloud_view import CloudView
from app.ui.scene.coverage_view import CoverageView
from app.ui.scene.ghost_view import GhostView
from app.ui.scene.goal_view import GoalView
from app.ui.scene.hand_view import HandView
from app.ui.scene.memory_view import MemoryView
from app.ui.scene.pair_view import PairView
from app.ui.scene.robot_view import RobotView
from app.ui.scene.separation_view import SeparationView
from app.ui.scene.stage import Stage
from app.ui.scene.switch import Switch
from app.ui.scene.world_view import WorldView
from app.ui.server import close_page, open_page, page_url
from app.ui.shelf import Shelf
from app.ui.traffic import Traffic
from app.ui.undo import Undo

TOUR = (  # heard by static_assets/page/tour.js
    '<button data-flinch-tour title="five short steps" style="margin:0 0.8em 0.7em;padding:'
    '0.3em 0.9em;cursor:pointer;font:inherit">Show the tour</button>'
)


class Page:
    """Built at once, shown from `start` to `stop`; a context manager does both.

    Raises `ServerError` when the port is taken.
    """

    def __init__(
        self,
        engine: Engine,
        host: str = "127.0.0.1",
        port: int = 8080,
        clock: Clock | None = None,
        shapes: Shapes = SHAPES,
        token: str = "",
        origins: tuple[str, ...] = (),
        desk: Desk | None = None,
    ) -> None:
        """The way in, as `app.ui.entrance` has it: an empty token lets every page operate.

        desk: of the arm's recordings; None: nothing can be recorded from the page.
        """
        clock = clock or WallClock()
        self.access = Access(token)
        self.gate = Gate(self.access, clock)
        title = f"Flinch · {engine.robot.title}"
        self.server = open_page(host, port, title, self.gate, origins)
        try:
            self._build(engine, clock, shapes, desk)
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

    def _build(self, engine: Engine, clock: Clock, shapes: Shapes, desk: Desk | None) -> None:
        server, gui = self.server, self.server.gui
        traffic = Traffic(server)
        self._build_scene(engine, clock)
        gui.main_panel.dock_right()
        gui.main_panel.set_width(400)
        self.arm = ArmPanel(server, engine, clock, self.reading)
        self.control = ControlPanel(server, engine, clock)
        self.blind = show_blind(server, engine)
        self._build_tabs(engine, clock, shapes, desk, traffic)
        listen_to_clicks(server, engine, self.chosen, self.cloud, self.coverage)
        self.roles = Roles(server, self.gate, self.arm.everybody, self._let_go)

        views: tuple[View, ...] = (
            self.reading, self.stage, self.cell, self.robot, self.ghost, self.cloud, self.pair,
            self.goal, self.world, self.arm, self.control, self.obstacles, self.background,
            self.move, self.params, self.plot, self.health, self.memory, self.roles,
            self.skin, self.separation, self.cones, self.clicked, self.coverage, self.people,
            self.hand,
        )  # fmt: skip
        if self.record is not None:
            views = (*views, self.record)
        self.pump = Pump(server, engine, views, clock, traffic, self.arm.silent)

    def _build_scene(self, engine: Engine, clock: Clock) -> None:
        server = self.server
        self.stage = Stage(server, engine)
        self.cell = CellView(server, engine.cell)
        self.robot = RobotView(server, engine)
        self.cones = BlindView(server, engine)
        self.cloud = CloudView(server, engine)
        self.memory = MemoryView(server)
        self.chosen = Chosen(engine.skin)
        self.clicked = ChosenView(server, engine, self.chosen)
        self.reading = Reading(engine.robot)
        self.pair = PairView(server, engine, self.reading)
        self.separation = SeparationView(server)
        self.ghost = GhostView(server, engine)
        self.undo = Undo(engine, clock)  # remembers what moves the goal and the bodies
        self.goal = GoalView(server, self.undo, clock)
        self.world = WorldView(server, self.undo, lambda name: self.obstacles.select(name))
        self.hand = HandView(server, engine, self.world)

    def _build_tabs(
        self, engine: Engine, clock: Clock, shapes: Shapes, desk: Desk | None, traffic: Traffic
    ) -> None:
        server, gui = self.server, self.server.gui
        tabs = gui.add_tab_group()
        with tabs.add_tab("Move"):
            self.move = MovePanel(server, self.undo, clock)
        with tabs.add_tab("Cell"):
            self.obstacles = ObstaclesPanel(server, self.undo, clock, shapes)
            scenes = Shelf(desk.folder, "scene") if desk is not None else None
            scene = desk.scene if desk is not None else ""
            self.people = WorldPanel(server, engine, self.undo, scenes, scene)
            self.background = BackgroundPanel(server, engine)
        with tabs.add_tab("Skin"):
            self.skin = SkinPanel(server, engine, self.chosen)
            with gui.add_folder("How well it runs", expand_by_default=False):
                self.health = HealthPanel(server, engine, traffic)
        with tabs.add_tab("Plots"):
            self.plot = PlotPanel(server, engine)
        with tabs.add_tab("Settings"):
            shelf = Shelf(desk.folder, "settings") if desk is not None else None
            self.params = ParamsPanel(server, engine, clock, shelf)
        self.record: RecordPanel | None = None
        if desk is not None:
            with tabs.add_tab("Record"):
                self.record = RecordPanel(server, desk)
        with tabs.add_tab("View"):
            self.coverage = CoverageView(server, engine)
            switches = self._switches()
            self.switches = ViewPanel(server, [s for s in switches if s.sign is None])
        with tabs.add_tab("Help"):
            gui.add_html(TOUR)
            show_help(server, asset_folder("static_assets") / "manual")
        self.legend = Legend(server, switches)

    def _let_go(self, page: int) -> None:
        """The page has lost the lease, maybe with the mouse on a handle."""
        self.goal.hands.release(page)
        self.world.let_go(page)

    def _switches(self) -> list[Switch]:
        views = (
            self.robot, self.ghost, self.world, self.goal, self.pair, self.cloud, self.memory,
            self.cell, self.stage, self.cones, self.clicked, self.coverage,
        )  # fmt: skip
        return [switch for view in views for switch in view.switches()]
