"""A person's eyes and hands: find things in a window, press, drag, and wait with a deadline."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray
from playwright.sync_api import Page as Window

from app.ui.page import Page

READY = "() => window.__viserMutable?.nodeRefFromName?.['/goal'] !== undefined"


def until(window: Window, done: Callable[[], Any], what: str, seconds: float = 15.0) -> Any:
    """The first true answer of `done`; fails telling `what` after `seconds`."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        answer = done()
        if answer:
            return answer
        window.wait_for_timeout(50)
    raise AssertionError(f"not within {seconds:g} s: {what}")


def resize(window: Window, width: int, height: int) -> None:
    """Make the window that large, and wait until what is laid out in it has followed."""
    window.set_viewport_size({"width": width, "height": height})
    places: list[Any] = [None]

    def still() -> bool:
        stop = window.get_by_role("button", name="Stop", exact=True).first
        places.append(stop.bounding_box())
        window.wait_for_timeout(250)
        return bool(places[-1] == places[-2])

    window.wait_for_timeout(250)
    until(window, still, f"laid out at {width}x{height}")


def nodes(window: Window) -> set[str]:
    """Names of everything that the window has in its scene."""
    script = "Object.entries(window.__viserMutable.nodeRefFromName)"
    return {name for name, there in window.evaluate(f"{script}.map(([k, v]) => [k, !!v])") if there}


def position(window: Window, name: str) -> NDArray[np.float64]:
    """(3,) [m] where the window draws the node, relative to its parent."""
    script = "name => window.__viserMutable.nodeRefFromName[name].position.toArray()"
    return np.array(window.evaluate(script, name))


def props(window: Window, name: str) -> dict[str, Any]:
    """What the window was last told about the node; arrays as lists of numbers."""
    return window.evaluate(
        """name => Object.fromEntries(
            Object.entries(window.__viserSceneTree.getState()[name].message.props).map(
                ([k, v]) => [k, ArrayBuffer.isView(v) ? Array.from(v) : v]))""",
        name,
    )


def shown(window: Window, name: str) -> bool:
    """Whether the window draws the node."""
    return bool(window.evaluate("n => window.__viserSceneTree.getState()[n].visibility", name))


def spot(page: Page, point: NDArray[np.float64]) -> tuple[float, float]:
    """Pixel at which the first window's camera sees `point` (3,) [m], base frame."""
    camera = page.server.get_clients()[min(page.server.get_clients())].camera
    R = viser.transforms.SO3(camera.wxyz).as_matrix()
    x, y, z = R.T @ (point - camera.position)  # x right, y down, z ahead
    focal = camera.image_height / 2.0 / np.tan(camera.fov / 2.0)
    return camera.image_width / 2.0 + focal * x / z, camera.image_height / 2.0 + focal * y / z


def drag(window: Window, begin: tuple[float, float], end: tuple[float, float]) -> None:
    """Press at one pixel, move to another, let go, with pictures drawn in between.

    A handle notices the mouse above it while a picture is drawn; pressed before that, the
    mouse turns the camera instead. How long a picture takes depends on the machine.
    """
    window.mouse.move(*begin)
    pictures(window, 2)
    window.mouse.down()
    for x, y in np.linspace(begin, end, 9)[1:]:
        window.mouse.move(x, y)
        pictures(window, 1)
    window.mouse.up()


def pictures(window: Window, count: int) -> None:
    """Wait until the window has drawn so many pictures."""
    window.evaluate(
        """count => new Promise(done => {
            const next = left => left ? requestAnimationFrame(() => next(left - 1)) : done();
            next(count + 1);
        })""",
        count,
    )
