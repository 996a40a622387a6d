"""A page with no browser: an engine that only listens, snapshots made by hand, a person.

Who imports `the_page` and its fellows has the fixtures `page`, `clock`, `engine` and `built`.
"""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser

from app.actions import (
    Action,
)
from app.cell.parts import Box, Cell, HalfSpace
from app.config import Params
from app.messages import (
    BodyPose,
    BodyView,
    Cloud,
    Command,
    Goal,
    JointState,
    Mode,
    Pairs,
    SensorHealth,
    Snapshot,
    Status,
    Timing,
    Verdict,
)
from app.near import Near, Nearness
from app.robot.model import Robot, find_robot, load_robot
from app.robot.sensor_type import load_sensor_type
from app.robot.skin import Sensor, Skin, build_skin
from app.timing import Latest, ManualClock
from app.ui.page import Page
from app.ui.server import close_page, open_page

SENSORS = 2
CELL = Cell(
    boxes=(Box("table", np.eye(4), np.array([1.0, 1.0, 0.1])),),
    planes=(HalfSpace("floor", np.eye(4), np.array([2.0, 2.0])),),
)


@contextmanager
def serving(port: int) -> Iterator[viser.ViserServer]:
    """An empty page; its server is stopped on the way out, whatever happened."""
    server = open_page("127.0.0.1", port)
    try:
        yield server
    finally:
        close_page(server)


@dataclass
class FakeEngine:
    """Keeps what is posted; its owner puts the snapshots."""

    robot: Robot
    skin: Skin
    snapshots: Latest[Snapshot] = field(default_factory=Latest)
    source: str = "a test"
    editable: bool = True
    scene: str = "none"
    programs: tuple[str, ...] = ("screws",)
    cell: Cell = CELL
    posted: list[Action] = field(default_factory=list)

    def post(self, action: Action) -> None:
        self.posted.append(action)


def fake_skin(robot: Robot) -> Skin:
    """Two sensors on the forearm."""
    T = np.eye(4)
    T[:3, 3] = [0.0, 0.0, 0.1]
    kind = load_sensor_type("vl53l8cx")
    sensors = tuple(Sensor(f"s{k}", "forearm_link", T, kind, 0, False) for k in range(SENSORS))
    return build_skin("test", sensors, robot)


@pytest.fixture(name="engine", scope="module")
def the_engine() -> FakeEngine:
    robot = load_robot(find_robot("ur10e"))
    return FakeEngine(robot, fake_skin(robot))


@pytest.fixture(name="built", scope="module")
def the_built(engine: FakeEngine) -> Iterator[tuple[Page, ManualClock]]:
    clock = ManualClock(100.0)
    page = Page(engine, port=0, clock=clock)
    try:
        yield page, clock
    finally:
        page.server.stop()


@pytest.fixture(name="page")
def the_page(built: tuple[Page, ManualClock], engine: FakeEngine) -> Page:
    engine.posted.clear()
    built[1].t += 10.0  # no hand of an earlier test is still on a control
    return built[0]


@pytest.fixture(name="clock")
def the_clock(built: tuple[Page, ManualClock]) -> ManualClock:
    return built[1]


_stamps = iter(range(1, 1_000_000))


def snapshot(engine: FakeEngine, **changes: Any) -> Snapshot:
    """The arm at home with a kept, a self and an unseen point, one second after the last."""
    now = float(next(_stamps))
    posture = engine.robot.posture(engine.robot.home)
    slots = 64 * SENSORS
    points = np.full((slots, 3), np.nan)
    verdict = np.full(slots, Verdict.NO_TARGET, dtype=np.uint8)
    points[3], verdict[3] = [1.0, 0.0, 0.5], Verdict.KEPT
    points[70], verdict[70] = [0.5, 0.1, 0.6], Verdict.SELF
    n = len(engine.robot.links)
    distance = np.full(n, np.inf)
    on_robot, on_world = np.full((n, 3), np.nan), np.full((n, 3), np.nan)
    normal = np.full((n, 3), np.nan)
    distance[3], on_robot[3], on_world[3] = 0.25, [0.75, 0.0, 0.5], [1.0, 0.0, 0.5]
    normal[3] = [-1.0, 0.0, 0.0]
    slot = np.full(n, -1)
    pairs = Pairs(np.arange(n), distance, on_robot, on_world, normal, slot, 3)
    nearness = Nearness(Near(3, 0.25, 2.0, on_robot[3], on_world[3], normal[3]))
    zeros = np.zeros(slots)
    whole = Snapshot(
        tick=round(100 * now),
        stamp=now,
        joints=JointState(now, engine.robot.home, np.zeros(6)),
        T_base_link=posture.T_base_link,
        T_base_tool=posture.T_base_tool,
        goal=Goal(posture.T_base_tool),
        cloud=Cloud(
            points, verdict, zeros.astype(np.int16), zeros, zeros, np.full(SENSORS, now - 0.03)
        ),
        pairs=pairs,
        body=pairs,
        command=Command(np.zeros(6), activation=1.0),
        status=Status(Mode.HOLDING, "just begun", now),
        params=Params(),
        health=np.full(SENSORS, SensorHealth.GOOD, dtype=np.uint8),
        rate=np.full(SENSORS, 15.0),
        world=(),
        timing=Timing({"sense": 0.002}, 0.0001),
        nearness=nearness,
    )
    return replace(whole, **changes)


def show(page: Page, engine: FakeEngine, value: Snapshot) -> None:
    """Let the pump show one snapshot, as its thread would."""
    engine.snapshots.put(value, value.stamp)
    assert page.pump.step()


def nobody(pairs: Pairs) -> Pairs:
    """The pairs of an empty cloud."""
    gone = np.full_like(pairs.on_robot, np.nan)
    far = np.full_like(pairs.distance, np.inf)
    return Pairs(pairs.link, far, gone, gone, gone, np.full_like(pairs.slot, -1), -1)


def by_person(handle: Any) -> Any:
    """What a control's callback is told when a person has changed it."""
    return SimpleNamespace(client_id=0, client=None, target=handle)


def run(page: Page, handle: Any, value: Any) -> None:
    """Change a control as a window does: set the value, then call what listens to it."""
    handle._impl.value = value
    for callback in handle._impl.update_cb:
        call = callback(by_person(handle))
        asyncio.run_coroutine_threadsafe(call, page.server.get_event_loop()).result(5.0)


def cloud(page: Page, name: str) -> viser.PointCloudHandle:
    handle = page.server.scene.get_handle_by_name(f"/cloud/{name}")
    assert isinstance(handle, viser.PointCloudHandle)
    return handle


def body(name: str, half: float = 0.1, movable: bool = True) -> BodyView:
    corners = half * np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    return BodyView(name, corners, faces, (200, 10, 10), movable)


def at(view: BodyView, position: list[float]) -> BodyPose:
    T = np.eye(4)
    T[:3, 3] = position
    return BodyPose(view, T)
