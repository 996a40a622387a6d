"""The scene of a run, picture by picture, as viser plays it back: drawn by the page's own views."""

from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

import numpy as np

from app.actions import Action
from app.cell.parts import Cell
from app.messages import Array, Snapshot
from app.robot.model import Robot
from app.robot.skin import Skin
from app.timing import Latest
from app.ui.export.eye import Eye
from app.ui.pump import View
from app.ui.reading import Reading
from app.ui.scene.blind_view import BlindView
from app.ui.scene.cell_view import CellView
from app.ui.scene.cloud_view import CloudView
from app.ui.scene.ghost_view import GhostView
from app.ui.scene.memory_view import MemoryView
from app.ui.scene.pair_view import PairView
from app.ui.scene.poses import wxyz
from app.ui.scene.robot_view import RobotView
from app.ui.scene.separation_view import SeparationView
from app.ui.scene.stage import Stage
from app.ui.scene.world_view import WorldView
from app.ui.server import close_page, open_page


@dataclass(frozen=True, eq=False)
class Arm:
    """What the views want of an engine, of an arm that nobody can tell anything."""

    robot: Robot
    skin: Skin
    cell: Cell
    scene: str = ""
    source: str = ""
    editable: bool = False
    programs: tuple[str, ...] = ()
    snapshots: Latest[Snapshot] = field(default_factory=Latest)

    def post(self, action: Action) -> None:
        """Nobody is asked."""


class Film:
    """Snapshots shown one after another; `develop` gives what was shown, once, at the end.

    A context manager. viser keeps a server to draw on: it stands behind the page's door on a
    free port of this machine alone, and nobody is let in.
    """

    def __init__(self, arm: Arm, eye: Eye | None = None) -> None:
        """`eye` None: as the live page begins."""
        self._server = open_page(port=0)
        try:
            self._views = self._build(arm)
            if eye is not None:
                camera = self._server.initial_camera
                camera.position, camera.look_at = tuple(eye.position), tuple(eye.target)
            self._reel = self._server.get_scene_serializer()
        except BaseException:
            close_page(self._server)
            raise
        self._stamp: float | None = None

    def show(self, snapshot: Snapshot) -> None:
        """One picture, so long after the last as its stamp says."""
        if self._stamp is not None:
            self._reel.insert_sleep(snapshot.stamp - self._stamp)
        self._stamp = snapshot.stamp
        for view in self._views:
            view.update(snapshot)

    def develop(self, rest: float) -> str:
        """viser's page with all that was shown; the last picture stays for `rest` [s]."""
        self._reel.insert_sleep(rest)
        return self._reel.as_html()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        close_page(self._server)

    def _build(self, arm: Arm) -> tuple[View, ...]:
        server = self._server
        clouds = CloudView(server, arm)
        for switch in clouds.switches():
            if switch.label != "All points":  # the legend of the document shows and hides them
                switch.set(True)
        reading = Reading(arm.robot, stays=0.0)
        return (
            reading, Stage(server, arm), CellView(server, arm.cell), RobotView(server, arm),
            BlindView(server, arm), clouds, MemoryView(server), PairView(server, arm, reading),
            SeparationView(server), GhostView(server, arm), _GoalMark(self),
            WorldView(server, arm, lambda name: None),
        )  # fmt: skip


class _GoalMark:
    """The goal as axes: nobody drags it here."""

    def __init__(self, film: Film) -> None:
        self._axes = film._server.scene.add_frame("/goal", axes_length=0.12, axes_radius=0.005)
        self._shown: Array | None = None

    def update(self, snapshot: Snapshot) -> None:
        T = snapshot.goal.T_base_tool
        if self._shown is None or not np.array_equal(T, self._shown):
            self._shown = T
            self._axes.position, self._axes.wxyz = T[:3, 3], wxyz(T)
