"""What every test shares: repeatable random examples, and a real browser where there is one."""

import os
import shutil
from collections.abc import Iterator

import pytest
from hypothesis import settings
from playwright.sync_api import Browser, Error, sync_playwright

from app.robot.model import Robot, find_robot, load_robot
from app.robot.skin import Skin
from app.robot.skin_file import load_skin

# derandomize: the same examples in every run. No deadline: a first call may compile for seconds.
settings.register_profile("flinch", derandomize=True, deadline=None, database=None)
settings.load_profile("flinch")

CHROMIUM_FLAGS = [
    "--no-sandbox",  # root, as in a container, may not start it otherwise
    "--use-angle=swiftshader",  # WebGL without a graphics card
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
]


@pytest.fixture(scope="session")
def robot() -> Robot:
    """The UR10e, loaded once; it is frozen."""
    return load_robot(find_robot("ur10e"))


@pytest.fixture(scope="session")
def skin(robot: Robot) -> Skin:
    """Its three rings of ten."""
    assert robot.skin is not None
    return load_skin(robot.folder / robot.skin, robot)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """A headless Chromium: the machine's own, else Playwright's.

    Without one the test is skipped, but fails where CI=true. It lives for one module, since
    Playwright keeps an event loop in this thread and other modules may want to run their own.
    """
    names = ("chromium", "chromium-browser", "google-chrome")
    path = next(filter(None, map(shutil.which, names)), None)
    with sync_playwright() as playwright:
        try:
            chromium = playwright.chromium.launch(executable_path=path, args=CHROMIUM_FLAGS)
        except Error as e:
            why = f"no Chromium could be started ({e.message.splitlines()[0]}); run `make browser`"
        else:
            yield chromium
            chromium.close()
            return
    if os.environ.get("CI") == "true":
        pytest.fail(why, pytrace=False)
    pytest.skip(why)
