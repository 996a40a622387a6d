"""The arm moved by a person: jogged, sent home or to a pose, and taught a way."""

from concurrent.futures import Future, ThreadPoolExecutor
from html import escape
from typing import Any

import numpy as np
import viser

from app.actions import GoHome, SetGoal, SetMode, SetParams, SetPose
from app.config import tunables
from app.control.goals import goal_error
from app.control.reach import Reach, Short
from app.messages import Array, Mode, Snapshot
from app.poses import turns
from app.timing import Clock
from app.ui.access import words
from app.ui.engine import Engine
from app.ui.pacing import Every, HandsOff
from app.ui.panels.assign import assign
from app.ui.panels.jog_pad import JogPad, small_html
from app.ui.panels.teach_panel import TeachPanel

PERIOD = 0.2  # [s]
SETTLED = 0.5  # [s] that a goal stays before it is asked whether it can be reached
TURNING = 2.0  # [rad/m] how much the tool turns beside its way: the ratio of the defaults
MOVED = 1e-3  # [m], and an entry of a rotation: a goal that another hand has changed
HOME, HERE = "Home", "Goal to tool"
_FACTS = {t.name: t for t in tunables()}


class MovePanel:
    """Speed, what became of a jog, the buttons that are held, the goal in numbers, waypoints."""

    def __init__(self, server: viser.ViserServer, engine: Engine, clock: Clock) -> None:
        gui, fact = server.gui, _FACTS["goal_speed"]
        assert fact.low is not None and fact.high is not None  # numbers always have a range
        self._engine, self._pace, self._hands = engine, Every(PERIOD), HandsOff(clock)
        self.speed = gui.add_slider(
            "Speed [mm/s]", min=1000.0 * fact.low, max=1000.0 * fact.high, step=10.0,
            initial_value=1000.0 * fact.default,
            hint="of the tool, jogged or on its way to a goal; it turns in proportion",
        )  # fmt: skip
        self.told = gui.add_html(told_html(None))
        self.pad = JogPad(server, engine)
        with gui.add_folder("Goal"):
            self.goal = GoalFields(server, engine)
        with gui.add_folder("Waypoints", expand_by_default=False):
            self.teach = TeachPanel(server, engine)

        @self.speed.on_update
        async def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client_id is None:  # the page itself showed what another window has set
                return
            self._hands.touch()
            engine.post(SetParams(speeds(event.target.value / 1000.0)))

    def update(self, snapshot: Snapshot) -> None:
        self.pad.update(snapshot)
        self.goal.update(snapshot)
        self.teach.update(snapshot)
        if not self._pace.due(snapshot.stamp):
            return
        self.told.content = told_html(snapshot)
        if self._hands.free:
            assign(self.speed, round(1000.0 * snapshot.params.goal_speed, 3))


class GoalFields:
    """Where the tool is and how far it has to go; the goal in numbers, which follow it."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        gui = server.gui
        self._engine, self._pace, self._reach = engine, Every(PERIOD), Reach(engine.robot)
        self._snapshot: Snapshot | None = None
        self._edited: Array | None = None  # the goal at which a person began to type
        self._since: tuple[Array, float] | None = None  # the goal, and since when it stays
        # a tenth of a second where there is no way: neither the arm nor the page waits for it
        self._asking = ThreadPoolExecutor(1, "flinch-reach")
        self.asked: Future[Short] | None = None
        self.now = gui.add_html("")
        self.position = gui.add_vector3(
            "Tool [mm]", (0.0, 0.0, 0.0), step=10.0, hint="x, y, z from the base"
        )
        self.rpy = gui.add_vector3(
            "Turn [deg]", (0.0, 0.0, 0.0), step=5.0, hint="roll, pitch, yaw about the base's axes"
        )
        self.go = gui.add_button("Go there", icon=viser.Icon.TARGET)
        self.others = gui.add_button_group("", (HOME, HERE))

        for field in (self.position, self.rpy):

            @field.on_update
            async def _(event: Any) -> None:
                if event.client_id is not None and self._snapshot is not None:
                    self._edited = self._snapshot.goal.T_base_tool

        @self.go.on_click
        async def _(event: Any) -> None:
            self._edited = None
            x, y, z = (float(v) / 1000.0 for v in self.position.value)
            roll, pitch, yaw = (float(v) for v in np.radians(self.rpy.value))
            engine.post(SetPose((x, y, z), (roll, pitch, yaw)))
            self._set_out(event)

        @self.others.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            self._edited = None
            if event.target.value == HOME:
                engine.post(GoHome())
                self._set_out(event)
            elif self._snapshot is not None:
                engine.post(SetGoal(self._snapshot.T_base_tool))

    def update(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        if not self._pace.due(snapshot.stamp):
            return
        T = snapshot.goal.T_base_tool
        self._ask(snapshot)
        short = self.asked.result().words if self.asked and self.asked.done() else ""
        self.now.content = now_html(snapshot, short)
        if self._edited is not None and _moved(T, self._edited):
            self._edited = None  # another hand has set a goal since
        if self._edited is None:
            x, y, z = (float(v) for v in np.round(1000.0 * T[:3, 3], 1) + 0.0)
            assign(self.position, (x, y, z))
            a, b, c = (float(v) for v in np.round(np.degrees(turns(T)), 1) + 0.0)
            assign(self.rpy, (a, b, c))

    def _set_out(self, event: Any) -> None:
        """An arm that holds begins to go; one that is stopped stays so until Run is pressed."""
        if self._snapshot is not None and self._snapshot.status.mode is Mode.HOLDING:
            reason = f"sent by a person at {words(event.client_id)}"
            self._engine.post(SetMode(Mode.RUNNING, reason))

    def _ask(self, snapshot: Snapshot) -> None:
        """Once for each goal that stays: how much is missing of it."""
        T, now = snapshot.goal.T_base_tool, snapshot.stamp
        if self._since is None or _moved(T, self._since[0]):
            self._since, self.asked = (T, now), None
        elif now - self._since[1] >= SETTLED:
            self.asked = self._asking.submit(self._reach.short, T, snapshot.joints.q)
            self._since = (T, np.inf)


def speeds(metres: float) -> dict[str, float]:
    """Settings of a tool that goes at most so fast [m/s], and turns in proportion."""
    out = {}
    for name, value in (("goal_speed", metres), ("goal_turning", TURNING * metres)):
        fact = _FACTS[name]
        assert fact.low is not None and fact.high is not None  # numbers always have a range
        out[name] = min(max(value, fact.low), fact.high)
    return out


def told_html(snapshot: Snapshot | None) -> str:
    """What was asked for, what is done of it, and why not more; one line of a fixed room."""
    text = "Hold a button or a key; let go, and the arm stays there"
    if snapshot is not None and snapshot.status.mode is Mode.STOPPED:
        text = "Stopped: press Run or Hold, then it can be moved by hand"
    elif snapshot is not None and snapshot.granted is not None:
        share = round(100.0 * min(max(snapshot.granted.share, -9.99), 1.0))
        text = f"{share} % of what is asked" if share >= 0 else "moves the other way: gives way"
        text += f" · {snapshot.granted.by}" if snapshot.granted.by else ""
    return (
        f'<div title="{escape(text)}" style="padding:0 1em;height:1.5em;line-height:1.5em;'
        f'font-size:0.85em;white-space:nowrap;overflow:hidden;text-overflow:ellipsis">'
        f"{escape(text)}</div>"
    )


def now_html(snapshot: Snapshot, short: str) -> str:
    """Where the tool is and how far it has to go; two lines of a fixed room."""
    x, y, z = np.round(1000.0 * snapshot.T_base_tool[:3, 3]) + 0.0
    way, turn = goal_error(snapshot.T_base_tool, snapshot.goal.T_base_tool)
    left = f"{100.0 * way:.0f} cm, {np.degrees(turn):.0f}° to go"
    if way < 0.005 and turn < 0.02:
        left = "at the goal"
    lines = (f"Tool now {x:.0f} {y:.0f} {z:.0f} mm · {left}", short or "\u00a0")
    return small_html(lines[0]) + small_html(lines[1])


def _moved(T: Array, before: Array) -> bool:
    return bool(np.abs(T - before).max() > MOVED)
