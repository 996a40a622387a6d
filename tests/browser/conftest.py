"""A running arm with its page, a window on it, and evidence of what failed."""

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hands import READY, until
from playwright.sync_api import Browser
from playwright.sync_api import Page as Window

from app.actions import RemoveObstacle, SetGoal, SetMode, SetParams
from app.config import Params, tunables
from app.messages import Goal, Mode, Snapshot
from app.robot.arm import SimulatedArm
from app.robot.model import Robot, find_robot, load_robot
from app.robot.skin import Skin
from app.robot.skin_file import load_skin
from app.runtime import Engine
from app.sensing.simulated import SimulatedSkin
from app.timing import WallClock
from app.ui.page import Page
from app.wiring import Start, assemble
from app.world.scene import find_scene, load_scene
from app.world.world import World

ARTIFACTS = Path(__file__).parents[2] / ".artifacts"
SMALL = (820, 460)  # pixels of a window that is not alone
RATE = 40.0  # [Hz] a slow loop: the browser draws in software on the same processor


class Live(NamedTuple):
    """The arm, its page, and the goal at which every test begins."""

    engine: Engine
    page: Page
    goal: Goal

    @property
    def now(self) -> Snapshot:
        snapshot, _ = self.engine.snapshots.get()
        assert snapshot is not None
        return snapshot


@pytest.fixture(scope="module")
def live() -> Iterator[Live]:
    """With the robot's own skin."""
    robot = load_robot(find_robot("ur10e"))
    assert robot.skin is not None
    with running(robot, load_skin(robot.folder / robot.skin, robot)) as arm:
        yield arm


@contextmanager
def running(robot: Robot, skin: Skin) -> Iterator[Live]:
    """An arm that wears `skin` in an empty place, and its page."""
    scene = load_scene(find_scene("empty"))
    world = World(scene.bodies)
    source = SimulatedSkin(robot, skin, world)
    patient = Params(silence=2.0)  # a browser that starts may hold the processor for a second
    arm = SimulatedArm(robot)
    engine = assemble(
        robot, skin, arm, source, world, WallClock(), Start(scene.cell, patient), RATE
    )
    engine.start()
    try:
        with Page(engine, port=0) as page:
            # both take most of the time of a picture that is drawn without a graphics card
            page.stage.cast_shadows(False)
            page.server.scene.configure_environment_map(None)
            yield Live(engine, page, Goal(robot.posture(robot.home).T_base_tool))
    finally:
        engine.stop()


@pytest.fixture(scope="module")
def window(live: Live, browser: Browser) -> Iterator[Window]:
    """The first window, open for the whole module: a page takes seconds to load in software."""
    window = open_window(browser, live.page.url)
    yield window
    window.close()


@pytest.fixture(autouse=True)
def at_home(live: Live, window: Window) -> None:
    """Begin as after a start: no obstacle, none remembered, default settings, running, near the
    first goal."""
    post = live.engine.post
    for body in live.now.world:
        if body.view.movable:
            post(RemoveObstacle(body.view.name))
    post(SetParams({t.name: t.default for t in tunables() if t.name != "silence"}))
    post(SetParams({"memory": False}))
    post(SetGoal(live.goal.T_base_tool))
    post(SetMode(Mode.RUNNING))
    home = live.goal.T_base_tool[:3, 3]
    until(
        window,
        lambda: np.linalg.norm(live.now.T_base_tool[:3, 3] - home) < 0.05,
        "the arm is back at its first goal",
    )
    post(SetParams({"memory": True}))


@pytest.fixture(autouse=True)
def evidence(request: pytest.FixtureRequest, window: Window) -> Iterator[None]:
    """After a failure: the first window's picture and console under `.artifacts`."""
    said: list[str] = []

    def note(message: Any) -> None:
        said.append(f"{message.type}: {message.text}")

    window.on("console", note)
    yield
    window.remove_listener("console", note)
    if request.node.stash.get(FAILED, False):
        ARTIFACTS.mkdir(exist_ok=True)
        window.screenshot(path=ARTIFACTS / f"{request.node.name}.png")
        (ARTIFACTS / f"{request.node.name}.log").write_text("\n".join(said), encoding="utf-8")


@pytest.fixture
def light(live: Live) -> Iterator[None]:
    """The heavy part of the scene hidden; what is hidden is in the scene all the same.

    Two windows that draw everything without a graphics card need a minute.
    """
    views = (live.page.robot, live.page.world, live.page.stage)
    heavy = [s for view in views for s in view.switches() if s.label != "Shadows"]
    for switch in heavy:
        switch.set(False)
    yield
    for switch in heavy:
        switch.set(True)


@pytest.fixture
def small(window: Window) -> Iterator[None]:
    """The first window made smaller, so that two can be drawn side by side."""
    before = window.viewport_size
    assert before is not None
    window.set_viewport_size({"width": SMALL[0], "height": SMALL[1]})
    yield
    window.set_viewport_size(before)


FAILED = pytest.StashKey[bool]()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.failed:
        item.stash[FAILED] = True
    return report


def open_window(browser: Browser, url: str, width: int = 1280, height: int = 720) -> Window:
    """A window of its own on the page, ready to be used."""
    window = browser.new_page(viewport={"width": width, "height": height})
    window.add_init_script("localStorage.setItem('flinch-tour', '1')")  # nobody new
    window.goto(url)
    window.wait_for_function(READY, timeout=60_000)
    window.locator('[data-arm]:not([data-arm="Waiting"])').wait_for(timeout=30_000)
    return window
