"""A layout with covers on the upper arm, as TOML only, as a person sees it."""

from collections.abc import Iterator

import numpy as np
import pytest
from conftest import Live
from hands import nodes, position, props, shown, until
from playwright.sync_api import Page as Window

from app.config import Params
from app.messages import Goal
from app.setup import Setup
from app.timing import WallClock
from app.ui.page import Page
from app.wiring import build_engine
from tests.own_place import write_place

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Live]:
    """The UR10e in that layout beside a post, in a cell of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        place = write_place(tmp_path_factory.mktemp("place"))
        setup = Setup(skin=place["skin"], cell=place["cell"], scene=place["scene"], rate=50.0)
        # a browser that starts may hold the processor for a second
        engine = build_engine(setup, WallClock(), Params(silence=2.0))
    engine.start()
    try:
        with Page(engine, port=0) as page:
            page.stage.cast_shadows(False)
            page.server.scene.configure_environment_map(None)
            yield Live(engine, page, Goal(engine.robot.posture(engine.robot.home).T_base_tool))
    finally:
        engine.close()


@pytest.fixture(autouse=True)
def at_home() -> None:
    """The arm gives way from the start: it is not led back."""


def test_the_covers_the_cell_and_what_the_sensors_see_are_drawn(live: Live, window: Window) -> None:
    cover = "/robot/upper_arm_cover"
    wanted = {
        cover,
        f"{cover}/mesh",
        "/robot/upper_arm_link/sensors",
        "/cell/boxes",
        "/cell/planes/floor",
    }
    until(window, lambda: wanted <= nodes(window), f"in the scene: {wanted - nodes(window)}")
    assert "/robot/forearm_cover" not in nodes(window)
    until(window, lambda: shown(window, "/cloud/kept"), "the skin sees the post")
    points = np.reshape(props(window, "/cloud/kept")["points"], (-1, 3))
    assert len(points) > 50
    i = live.engine.robot.link_index("upper_arm_cover")
    until(
        window,
        lambda: np.allclose(position(window, cover), live.now.T_base_link[i, :3, 3], atol=0.02),
        "the cover moves with its link",
    )
    assert window.get_by_text("nothing else: raise radius_m").count() == 0
