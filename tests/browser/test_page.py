"""The page as a person uses it: a real browser, a mouse and a keyboard, a simulated arm."""

import http.server
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from conftest import SMALL, Live, open_window
from hands import drag, nodes, position, props, shown, spot, until
from playwright.sync_api import Browser
from playwright.sync_api import Page as Window

from app.actions import AddObstacle, SetGoal, SetParams
from app.messages import Mode
from app.ui.access import words
from app.ui.colours import POINT

pytestmark = pytest.mark.browser
# far enough from the forearm to be seen and not to be felt
PILLAR = AddObstacle(
    "Pillar", {"kind": "cylinder", "radius_m": 0.2, "length_m": 2.0}, (0.2, -0.9, 0.5)
)


def lifted(live: Live, height: float) -> SetGoal:
    """The first goal, so much [m] higher."""
    T = live.goal.T_base_tool.copy()
    T[2, 3] += height
    return SetGoal(T)


def test_the_page_connects(live: Live, window: Window) -> None:
    assert len(live.page.server.get_clients()) == 1
    assert window.get_by_text("goes to the goal and gives way").is_visible()
    assert window.get_by_text("not an emergency stop").first.is_visible()
    assert live.page.fault is None


def test_all_links_and_clouds_are_in_the_scene(live: Live, window: Window) -> None:
    robot, skin = live.engine.robot, live.engine.skin
    wanted = {f"/robot/{link}" for link in robot.links}
    wanted |= {f"/robot/{s.link}/sensors" for s in skin.sensors}
    wanted |= {f"/cloud/{v.name.lower()}" for v in POINT} | {"/cloud/raw", "/goal", "/tool"}
    until(window, lambda: wanted <= nodes(window), f"in the scene: {wanted - nodes(window)}")
    live.engine.post(PILLAR)
    until(window, lambda: shown(window, "/cloud/kept"), "the skin sees the pillar")


def test_links_and_clouds_move_with_the_arm(live: Live, window: Window) -> None:
    live.engine.post(PILLAR)
    until(window, lambda: shown(window, "/cloud/kept"), "the skin sees the pillar")
    before = position(window, "/robot/wrist_3_link")
    points = props(window, "/cloud/kept")["points"]
    live.engine.post(lifted(live, 0.15))

    def moved() -> bool:
        here = position(window, "/robot/wrist_3_link")
        return bool(here[2] - before[2] > 0.1)

    until(window, moved, "the last link has risen by 10 cm")
    assert props(window, "/cloud/kept")["points"] != points
    true = live.now.T_base_link[-1][:3, 3]
    np.testing.assert_allclose(position(window, "/robot/wrist_3_link"), true, atol=0.05)


def test_dragging_the_goal_with_the_mouse_moves_the_arm(live: Live, window: Window) -> None:
    # nothing here is in the way, and no stray point shall keep the tool from its goal
    live.engine.post(SetParams({"distance_kept": 0.05}))
    home = live.goal.T_base_tool
    origin, axis = home[:3, 3], home[:3, 2]  # the tool's axis points down
    drag(window, spot(live.page, origin + 0.24 * axis), spot(live.page, origin + 0.08 * axis))
    goal = until(window, lambda: live.now.goal.T_base_tool[2, 3] > origin[2] + 0.1, "a new goal")
    goal = live.now.goal.T_base_tool
    assert np.linalg.norm((goal - home)[:2, 3]) < 0.01  # along the arrow only

    def arrived() -> bool:
        return bool(np.linalg.norm((live.now.T_base_tool - goal)[:3, 3]) < 0.03)

    until(window, arrived, "the tool is at the dragged goal")
    until(
        window,
        lambda: np.linalg.norm(position(window, "/tool") - goal[:3, 3]) < 0.03,
        "the window shows the tool there",
    )


def test_an_obstacle_dragged_to_the_arm_is_felt(live: Live, window: Window) -> None:
    window.get_by_role("tab", name="Cell").click()
    window.get_by_role("button", name="Box", exact=True).click()
    until(window, lambda: "/world/Box 1" in nodes(window), "the box is in the scene")
    far = until(window, lambda: np.linalg.norm(position(window, "/world/Box 1")), "it is placed")
    assert far < 2.0  # beside the arm
    start = position(window, "/world/Box 1")

    elbow = live.now.T_base_link[3][:3, 3]
    beside = np.array([elbow[0] + 0.35, elbow[1] - 0.30, start[2]])
    window.keyboard.down("Shift")  # at its height
    drag(window, spot(live.page, start), spot(live.page, beside))
    window.keyboard.up("Shift")

    def moved() -> bool:
        return bool(np.linalg.norm(position(window, "/world/Box 1") - start) > 0.1)

    until(window, moved, "the box is beside the arm")
    there = position(window, "/world/Box 1")
    assert there[2] == pytest.approx(start[2], abs=0.01)

    def felt() -> bool:
        arrow = np.reshape(props(window, "/pair/closest")["points"], (2, 3))
        on_the_box = np.abs(arrow[0] - there).max() < 0.2  # its half edge is 0.1 m
        return bool(on_the_box and shown(window, "/pair/closest"))

    until(window, felt, "the arrow begins at the box")
    until(window, lambda: live.now.command.activation > 0.0, "the arm gives way")


@pytest.mark.slow
def test_a_deleted_obstacle_leaves_the_scene(live: Live, window: Window) -> None:
    window.get_by_role("tab", name="Cell").click()
    window.get_by_role("button", name="Sphere", exact=True).click()
    until(window, lambda: "/world/Sphere 1" in nodes(window), "the sphere is in the scene")
    button = window.get_by_role("button", name="Delete it")
    until(window, button.is_enabled, "it can be deleted")
    button.click()
    until(window, lambda: "/world/Sphere 1" not in nodes(window), "the sphere is gone")


def test_the_stop_button_stops_the_arm(live: Live, window: Window) -> None:
    live.engine.post(SetParams({"goal_speed": 0.05}))  # time enough to press the button on the way
    live.engine.post(lifted(live, 0.3))
    until(window, lambda: np.abs(live.now.joints.qd).max() > 0.02, "the arm moves")
    window.get_by_role("button", name="Stop", exact=True).click()
    until(window, lambda: live.now.status.mode is Mode.STOPPED, "stopped", seconds=3.0)
    until(window, lambda: np.abs(live.now.joints.qd).max() < 1e-3, "it stands", seconds=3.0)
    window.get_by_text("Stopped", exact=True).wait_for(timeout=5_000)
    q, ticks = live.now.joints.q, live.now.tick
    until(window, lambda: live.now.tick > ticks + 30, "half a second passes")
    np.testing.assert_allclose(live.now.joints.q, q, atol=1e-4)
    assert np.linalg.norm(live.now.T_base_tool[:3, 3] - live.now.goal.T_base_tool[:3, 3]) > 0.05


def test_the_keys_stop_and_run(live: Live, window: Window) -> None:
    window.keyboard.press("s")
    until(window, lambda: live.now.status.mode is Mode.STOPPED, "S stops")
    window.keyboard.press("h")
    until(window, lambda: live.now.status.mode is Mode.HOLDING, "H holds")
    window.keyboard.press("r")
    until(window, lambda: live.now.status.mode is Mode.RUNNING, "R runs")


@pytest.mark.usefixtures("light", "small")
@pytest.mark.slow
def test_a_second_window_sees_the_same(live: Live, window: Window, browser: Browser) -> None:
    other = open_window(browser, live.page.url, *SMALL)
    try:
        until(other, lambda: nodes(other) == nodes(window), "the same things in both scenes")
        live.engine.post(lifted(live, 0.1))
        z = live.goal.T_base_tool[2, 3] + 0.1
        for w in (window, other):
            until(w, lambda w=w: abs(position(w, "/tool")[2] - z) < 0.01, "the tool has risen")  # type: ignore[misc]
        for w in (window, other):
            w.get_by_role("tab", name="Settings").click()
        field = window.get_by_role("textbox").filter(visible=True).first
        field.fill("300")
        field.press("Enter")
        until(window, lambda: live.now.params.distance_kept == 0.3, "the setting has arrived")
        twin = other.get_by_role("textbox").filter(visible=True).first
        until(other, lambda: twin.input_value() == "300", "the other window shows it")
    finally:
        other.close()


def says(window: Window, words: str) -> bool:
    return window.get_by_text(words).first.is_visible()


@pytest.mark.slow  # two whole windows drawn in software take a minute; test_ui_gate has the rules
@pytest.mark.usefixtures("light")
def test_the_second_page_watches_stops_and_takes_over(
    live: Live, window: Window, browser: Browser
) -> None:
    other = open_window(browser, live.page.url, *SMALL)
    me = words(max(live.page.server.get_clients()))
    try:
        assert says(window, "You operate the arm (page 1)")
        assert says(other, f"You watch ({me}); page 1 operates")
        run, stop = (other.get_by_role("button", name=name, exact=True) for name in ("Run", "Stop"))
        until(other, run.is_disabled, "the watcher's Run is disabled")
        assert window.get_by_role("button", name="Run", exact=True).is_enabled()

        stop.click()
        until(other, lambda: live.now.status.mode is Mode.STOPPED, "a watcher can stop the arm")
        other.keyboard.press("r")
        until(other, lambda: says(other, "You watch"), "a hint")
        other.get_by_text("page 1 operates; you can stop the arm").wait_for(timeout=5_000)
        assert live.now.status.mode is Mode.STOPPED

        other.get_by_role("button", name="Take control").click()
        until(other, lambda: says(other, "page 1 operates; it is free when"), "told when")
        window.bring_to_front()  # a window behind another one is hardly drawn, or fed
        window.get_by_role("button", name="Give control back").click()
        other.bring_to_front()
        until(other, lambda: says(other, "nobody operates"), "the lease is free")
        other.get_by_role("button", name="Take control").click()
        until(other, run.is_enabled, "the second page operates")
        run.click()
        until(other, lambda: live.now.status.mode is Mode.RUNNING, "it runs the arm")
        assert says(window, f"You watch (page 1); {me} operates")

        # a watcher's drag is refused, and its handle returns to the goal
        before, home = live.now.goal.T_base_tool, live.goal.T_base_tool
        origin, axis = home[:3, 3], home[:3, 2]
        refused = live.page.gate.refused
        window.bring_to_front()
        drag(window, spot(live.page, origin + 0.24 * axis), spot(live.page, origin))
        until(window, lambda: live.page.gate.refused > refused + 1, "the drag is refused")
        np.testing.assert_array_equal(live.now.goal.T_base_tool, before)
    finally:
        other.close()
    until(window, lambda: says(window, "nobody operates"), "a closed page gives it back")
    window.get_by_role("button", name="Take control").click()
    until(window, lambda: says(window, "You operate the arm (page 1)"), "the first again")


@pytest.fixture
def stranger() -> Iterator[str]:
    """The address of somebody else's page on this machine."""

    class Blank(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<title>elsewhere</title>")

        def log_message(self, format: str, *args: object) -> None:
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Blank)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://localhost:{server.server_port}/"
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_page_from_elsewhere_gets_403(live: Live, browser: Browser, stranger: str) -> None:
    elsewhere = browser.new_page()
    said: list[str] = []
    elsewhere.on("console", lambda message: said.append(message.text))
    elsewhere.goto(stranger)
    result = elsewhere.evaluate(
        """url => new Promise(done => {
            const socket = new WebSocket(url, "viser-v1.1.1");
            socket.onopen = () => done("open");
            socket.onerror = () => done("refused");
        })""",
        live.page.url.replace("http", "ws"),
    )
    assert result == "refused"
    until(elsewhere, lambda: any("403" in text for text in said), f"a 403 in {said}", 5.0)
    elsewhere.close()
