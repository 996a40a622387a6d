"""The goal as a handle to drag, and the tool as it is.

Two windows share the handle. It follows the arm's goal, except while a hand is on it and a
moment after, when snapshots still tell an older goal.
"""

import viser

from app.actions import SetGoal
from app.messages import Snapshot
from app.timing import Clock
from app.ui.colours import GOAL
from app.ui.engine import Engine
from app.ui.pacing import HandsOff
from app.ui.scene.poses import follow, pose
from app.ui.scene.switch import Sign, Switch

HANDLE = "where the tool should go: drag its arrows and arcs"
AXES = "where the tool is"


class GoalView:
    """A six-axis handle at the goal and axes at the tool."""

    def __init__(self, server: viser.ViserServer, engine: Engine, clock: Clock) -> None:
        self.hands = HandsOff(clock)
        self.handle = server.scene.add_transform_controls(
            "/goal", scale=0.3, line_width=3.0, depth_test=False, opacity=0.85
        )
        self.tool = server.scene.add_frame("/tool", axes_length=0.10, axes_radius=0.004)

        @self.handle.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            self.moved(event, engine)

    def moved(self, event: viser.TransformControlsEvent, engine: Engine) -> None:
        """A window grabs, moves or releases the handle."""
        if event.phase == "start":
            self.hands.grab(event.client_id)
            return
        if event.phase == "end" and not self.hands.release(event.client_id):
            return  # the lease has been lost meanwhile, and the goal may be another's by now
        engine.post(SetGoal(pose(event.target.wxyz, event.target.position)))

    def update(self, snapshot: Snapshot) -> None:
        follow(self.tool, snapshot.T_base_tool)
        if self.hands.free:
            follow(self.handle, snapshot.goal.T_base_tool)

    def switches(self) -> list[Switch]:
        return [
            Switch(
                "Goal", True, lambda on: setattr(self.handle, "visible", on), HANDLE, Sign(GOAL)
            ),
            Switch("Tool axes", True, lambda on: setattr(self.tool, "visible", on), AXES),
        ]

    def _show_handle(self, on: bool) -> None:
        self.handle.visible = on


class RecordedGoalView:
    """Axes at the goal and at the tool: nobody can move what has happened."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.goal = server.scene.add_frame("/goal", axes_length=0.15, axes_radius=0.003)
        self.tool = server.scene.add_frame("/tool", axes_length=0.10, axes_radius=0.004)

    def update(self, snapshot: Snapshot) -> None:
        follow(self.tool, snapshot.T_base_tool)
        follow(self.goal, snapshot.goal.T_base_tool)

    def switches(self) -> list[Switch]:
        return [
            Switch("Goal", True, lambda on: setattr(self.goal, "visible", on)),
            Switch("Tool axes", True, lambda on: setattr(self.tool, "visible", on), AXES),
        ]
