"""The page without a browser: its server, its views' handles, its callbacks."""

import asyncio
import socket
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import viser
from viser import _messages
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from app.config import Params, tunables
from app.errors import ServerError
from app.messages import (
    Action,
    AddObstacle,
    BodyPose,
    BodyView,
    Cloud,
    Command,
    CropBox,
    GhostState,
    Goal,
    JointState,
    Mode,
    MoveObstacle,
    Pairs,
    RunProgram,
    SensorHealth,
    SetGoal,
    SetMode,
    SetParams,
    SetPose,
    Snapshot,
    Status,
    Timing,
    Verdict,
)  # fmt: skip
from app.robot.model import Robot, find_robot, load_robot
from app.robot.skin import Sensor, Skin, build_skin
from app.timing import Latest, ManualClock
from app.ui.colours import ALARM, CALM, HEALTH, POINT, activation_colour
from app.ui.pacing import HANDS_OFF, Every
from app.ui.page import Page
from app.ui.panels.obstacles_panel import SHAPES, placed
from app.ui.panels.plot_panel import LENGTH
from app.ui.pump import Pump
from app.ui.scene.cloud_view import WORDS, parked
from app.ui.scene.world_view import at_height
from app.ui.server import open_page, page_url, serving
from app.ui.traffic import Traffic
from app.world.world import World

SENSORS = 2


@dataclass
class FakeEngine:
    """Keeps what is posted; its owner puts the snapshots."""

    robot: Robot
    skin: Skin
    snapshots: Latest[Snapshot] = field(default_factory=Latest)
    source: str = "a test"
    scene: str = "none"
    programs: tuple[str, ...] = ("screws",)
    crops: tuple[CropBox, ...] = (CropBox("table", np.eye(4), np.array([1.0, 1.0, 0.1])),)
    posted: list[Action] = field(default_factory=list)

    def post(self, action: Action) -> None:
        self.posted.append(action)


@pytest.fixture(scope="module")
def engine() -> FakeEngine:
    robot = load_robot(find_robot("ur10e"))
    T = np.eye(4)
    T[:3, 3] = [0.0, 0.0, 0.1]
    sensors = tuple(Sensor(f"s{k}", "forearm_link", T, 8, 0, False) for k in range(SENSORS))
    return FakeEngine(robot, build_skin("test", sensors, robot))


@pytest.fixture(scope="module")
def built(engine: FakeEngine) -> Iterator[tuple[Page, ManualClock]]:
    clock = ManualClock(100.0)
    page = Page(engine, port=0, clock=clock)
    try:
        yield page, clock
    finally:
        page.server.stop()


@pytest.fixture
def page(built: tuple[Page, ManualClock], engine: FakeEngine) -> Page:
    engine.posted.clear()
    built[1].t += 10.0  # no hand of an earlier test is still on a control
    return built[0]


@pytest.fixture
def clock(built: tuple[Page, ManualClock]) -> ManualClock:
    return built[1]


_stamps = iter(range(1, 10_000))


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


# --- the server -----------------------------------------------------------------------------


def knock(server: viser.ViserServer, origin: str | None) -> int:
    """Status with which the server answers a web socket from a page at `origin`."""

    async def call() -> int:
        url = page_url(server).replace("http", "ws")
        try:
            version = f"viser-v{viser.__version__}"
            async with connect(url, origin=origin, subprotocols=[version], proxy=None):  # type: ignore[arg-type, list-item]
                return 101
        except InvalidStatus as e:
            return e.response.status_code

    return asyncio.run(call())


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
def test_the_own_page_gets_in(page: Page, name: str) -> None:
    assert knock(page.server, f"http://{name}:{page.server.get_port()}") == 101


def test_strangers_are_refused(page: Page) -> None:
    port = page.server.get_port()
    strangers = (
        "http://evil.example", f"http://evil.example:{port}", f"http://localhost:{port + 1}",
        f"https://localhost:{port}", f"http://localhost.evil.example:{port}", "null", None,
    )  # fmt: skip
    assert {origin: knock(page.server, origin) for origin in strangers} == dict.fromkeys(
        strangers, 403
    )


def test_it_listens_on_the_loopback_address_only(page: Page) -> None:
    """127.0.0.2 is this machine too, and would be answered by a server on 0.0.0.0."""
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.2", page.server.get_port()), timeout=5.0)


def test_a_taken_port_is_told_with_the_remedy(page: Page) -> None:
    port = page.server.get_port()
    with pytest.raises(ServerError, match=f"port {port} .* taken.* another port") as e:
        open_page(port=port)
    assert "\n" not in str(e.value)


def test_an_address_of_another_machine_is_told() -> None:
    with pytest.raises(ServerError, match=r"cannot listen on 192\.0\.2\.1"):
        open_page(host="192.0.2.1", port=0)


def test_nobody_can_ask_for_a_public_tunnel(page: Page) -> None:
    handlers = page.server._websock_server._incoming_handlers
    assert not handlers.get(_messages.ShareUrlRequest)


def test_a_stopped_server_frees_its_port() -> None:
    with serving(port=0) as server:
        port = server.get_port()
    with serving(port=port) as again:
        assert again.get_port() == port


# --- the scene ------------------------------------------------------------------------------


def test_links_go_where_the_snapshot_says(page: Page, engine: FakeEngine) -> None:
    q = engine.robot.home + 0.3
    posture = engine.robot.posture(q)
    show(page, engine, snapshot(engine, T_base_link=posture.T_base_link))
    for link, T in zip(engine.robot.links, posture.T_base_link, strict=True):
        handle = page.server.scene.get_handle_by_name(f"/robot/{link}")
        assert handle is not None
        np.testing.assert_allclose(handle.position, T[:3, 3], atol=1e-6)
        R = viser.transforms.SO3(handle.wxyz).as_matrix()
        np.testing.assert_allclose(R, T[:3, :3], atol=1e-6)


def test_a_sensor_is_coloured_by_its_health(page: Page, engine: FakeEngine) -> None:
    health = np.array([SensorHealth.POOR, SensorHealth.STALE], dtype=np.uint8)
    show(page, engine, snapshot(engine, health=health))
    (patch,) = page.robot.patches  # both sit on one link
    shown = [tuple(colour) for colour in patch.handle.batched_colors]
    assert shown == [HEALTH[SensorHealth(h)] for h in health]


def test_only_kept_points_are_shown_at_first(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine))
    seen = {v for v in POINT if cloud(page, v.name.lower()).visible}
    assert seen == {Verdict.KEPT}


def test_a_switched_on_class_shows_its_points(page: Page, engine: FakeEngine) -> None:
    box = page.switches.boxes[WORDS[Verdict.SELF][0]]
    run(page, box, True)
    show(page, engine, snapshot(engine))
    own = cloud(page, "self")
    assert own.visible
    np.testing.assert_allclose(np.unique(own.points, axis=0), [[0.5, 0.1, 0.6]], atol=1e-6)
    run(page, box, False)
    show(page, engine, snapshot(engine))
    assert not own.visible


def test_a_cloud_keeps_its_count_whatever_is_seen(page: Page, engine: FakeEngine) -> None:
    now = snapshot(engine)
    show(page, engine, now)
    before = cloud(page, "kept").points.shape
    verdict = now.cloud.verdict.copy()
    verdict[[3, 70]] = Verdict.KEPT
    show(page, engine, snapshot(engine, cloud=replace(now.cloud, verdict=verdict)))
    assert cloud(page, "kept").points.shape == before == (64 * SENSORS, 3)


def test_an_empty_class_is_hidden(page: Page, engine: FakeEngine) -> None:
    now = snapshot(engine)
    unseen = replace(now.cloud, points=np.full_like(now.cloud.points, np.nan))
    show(page, engine, replace(now, cloud=unseen))
    assert not cloud(page, "kept").visible


def test_empty_slots_are_parked_on_a_point_of_the_class() -> None:
    points = np.array([[np.nan] * 3, [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    out = parked(points, np.array([False, False, True]))
    assert out.dtype == np.float32
    np.testing.assert_array_equal(out, [[4.0, 5.0, 6.0]] * 3)


def test_the_arrow_leads_from_the_world_to_the_robot(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine))
    np.testing.assert_allclose(page.pair.arrow.points[0], [[1.0, 0.0, 0.5], [0.75, 0.0, 0.5]])
    assert page.pair.label.text == "25 cm · forearm"
    assert tuple(page.pair.arrow.colors) == ALARM  # the avoidance is fully active
    assert page.pair.arrow.visible and page.pair.label.visible


def test_no_arrow_without_a_point(page: Page, engine: FakeEngine) -> None:
    now = snapshot(engine)
    none = nobody(now.pairs)
    show(page, engine, replace(now, pairs=none, body=none))
    assert not page.pair.arrow.visible and not page.pair.label.visible


def test_link_arrows_of_unseen_links_repeat_the_closest(page: Page, engine: FakeEngine) -> None:
    run(page, page.switches.boxes["Link arrows"], True)
    show(page, engine, snapshot(engine))
    assert page.pair.others.visible
    assert np.isfinite(page.pair.others.points).all()
    assert len(page.pair.others.points) == len(engine.robot.links)
    run(page, page.switches.boxes["Link arrows"], False)


def test_activation_goes_from_calm_to_alarm() -> None:
    assert activation_colour(0.0) == CALM
    assert activation_colour(1.0) == activation_colour(1.3) == ALARM
    assert len({activation_colour(a) for a in np.linspace(0, 1, 101)}) == 5


def test_ground_lies_below_the_lowest_fixed_body(page: Page, engine: FakeEngine) -> None:
    low = body("floor", 0.1, movable=False)
    show(page, engine, snapshot(engine, world=(at(low, [0.0, 0.0, -0.8]),)))
    ground = page.server.scene.get_handle_by_name("/ground")
    assert ground is not None
    assert ground.position[2] == pytest.approx(-0.8 - 0.1 - 0.002)


# --- the goal -------------------------------------------------------------------------------


def drag_goal(page: Page, engine: FakeEngine, phase: str, x: float) -> None:
    page.goal.handle._impl.position[:] = [x, 0.0, 0.5]
    event: Any = SimpleNamespace(target=page.goal.handle, phase=phase, client_id=7)
    page.goal.moved(event, engine)


def test_a_dragged_goal_is_posted_and_not_pulled_back(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    drag_goal(page, engine, "start", 0.6)
    drag_goal(page, engine, "update", 0.7)
    clock.t += 60.0  # a slow hand
    show(page, engine, snapshot(engine))
    assert page.goal.handle.position[0] == pytest.approx(0.7)
    (goal,) = engine.posted
    assert isinstance(goal, SetGoal)
    np.testing.assert_allclose(goal.T_base_tool[:3, 3], [0.7, 0.0, 0.5])


def test_a_released_goal_follows_the_arm_again(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    drag_goal(page, engine, "end", 0.8)
    now = snapshot(engine)
    show(page, engine, now)
    assert page.goal.handle.position[0] == pytest.approx(0.8)
    clock.t += HANDS_OFF
    show(page, engine, snapshot(engine))
    np.testing.assert_allclose(page.goal.handle.position, now.goal.T_base_tool[:3, 3])


# --- the world ------------------------------------------------------------------------------


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


def test_bodies_appear_move_and_vanish(page: Page, engine: FakeEngine) -> None:
    ball = body("ball")
    show(page, engine, snapshot(engine, world=(at(ball, [1.0, 0.0, 0.0]),)))
    handle = page.server.scene.get_handle_by_name("/world/ball")
    assert handle is not None
    show(page, engine, snapshot(engine, world=(at(ball, [2.0, 0.0, 0.0]),)))
    assert page.server.scene.get_handle_by_name("/world/ball") is handle
    assert handle.position[0] == 2.0
    show(page, engine, snapshot(engine))
    assert page.server.scene.get_handle_by_name("/world/ball") is None


def test_a_body_that_looks_different_is_built_anew(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, world=(at(body("ball"), [1.0, 0.0, 0.0]),)))
    old = page.server.scene.get_handle_by_name("/world/ball")
    show(page, engine, snapshot(engine, world=(at(body("ball", 0.3), [1.0, 0.0, 0.0]),)))
    new: Any = page.server.scene.get_handle_by_name("/world/ball")
    assert new is not old
    assert new.vertices.max() == pytest.approx(0.3)


def pull(page: Page, phase: str, point: list[float], modifier: str | None = None) -> None:
    camera = SimpleNamespace(position=np.array([1.0, -2.0, 2.0]))
    event: Any = SimpleNamespace(
        phase=phase, client_id=1, client=SimpleNamespace(camera=camera), modifier=modifier,
        start_position=tuple(point), end_position=tuple(point),
    )  # fmt: skip
    page.world.drag("ball", event)


def test_a_dragged_body_follows_the_mouse(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, world=(at(body("ball"), [1.0, 0.0, 0.5]),)))
    pull(page, "start", [0.95, 0.0, 0.5])
    pull(page, "update", [0.75, 0.1, 0.7])
    pull(page, "end", [0.75, 0.1, 0.7])
    move = engine.posted[-1]
    assert isinstance(move, MoveObstacle)
    assert move.name == "ball"
    np.testing.assert_allclose(move.T_base_body[:3, 3], [0.8, 0.1, 0.7])


def test_with_shift_a_dragged_body_keeps_its_height(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, world=(at(body("ball"), [1.0, 0.0, 0.5]),)))
    pull(page, "start", [1.0, 0.0, 0.5], "shift")
    pull(page, "update", [0.8, 0.1, 0.9], "shift")
    pull(page, "end", [0.8, 0.1, 0.9], "shift")
    move = engine.posted[-1]
    assert isinstance(move, MoveObstacle)
    assert move.T_base_body[2, 3] == pytest.approx(0.5)
    assert move.T_base_body[0, 3] < 0.8  # the ray goes on behind the point on the screen


def test_a_body_is_not_dragged_out_of_sight(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, world=(at(body("ball"), [1.0, 0.0, 0.5]),)))
    pull(page, "start", [1.0, 0.0, 0.5])
    engine.posted.clear()
    pull(page, "update", [50.0, 0.0, 0.5])
    pull(page, "end", [50.0, 0.0, 0.5])
    assert engine.posted == []


def test_a_level_ray_does_not_move_a_body() -> None:
    eye, point = np.array([0.0, -2.0, 0.5]), np.array([0.0, 0.0, 0.5])
    np.testing.assert_array_equal(at_height(eye, np.array([1.0, 0.0, 0.5]), point), point)


# --- the panels -----------------------------------------------------------------------------


@pytest.mark.parametrize("shape", SHAPES)
def test_a_new_obstacle_stands_in_front_of_the_tool(engine: FakeEngine, shape: str) -> None:
    now = snapshot(engine)
    add, *rest = placed("new", dict(SHAPES[shape]), now)
    assert isinstance(add, AddObstacle)
    tool = now.T_base_tool[:3, 3]
    assert np.linalg.norm(np.array(add.position)[:2] - tool[:2]) == pytest.approx(0.6)
    assert np.linalg.norm(add.position[:2]) > np.linalg.norm(tool[:2])  # away from the base
    world = World([])
    assert world.add(add.name, add.shape, add.position) == "new"
    for action in rest:
        assert isinstance(action, MoveObstacle)
        world.move(action.name, action.T_base_body)
        thin = action.T_base_body[:3, 2]
        assert thin[2] == pytest.approx(0.0)  # upright


def test_two_new_obstacles_do_not_stand_in_each_other(engine: FakeEngine) -> None:
    (first,) = placed("a", dict(SHAPES["Box"]), snapshot(engine))
    assert isinstance(first, AddObstacle)
    there = (at(body("a"), list(first.position)),)
    (second,) = placed("b", dict(SHAPES["Box"]), snapshot(engine, world=there))
    assert isinstance(second, AddObstacle)
    assert np.linalg.norm(np.subtract(first.position, second.position)) > 0.3


def test_a_setting_of_a_person_is_posted_in_si_units(page: Page, engine: FakeEngine) -> None:
    run(page, page.params.controls["d_min"], 250.0)
    assert engine.posted == [SetParams({"d_min": 0.25})]


def test_a_setting_of_another_window_is_shown_and_not_posted_again(
    page: Page, engine: FakeEngine
) -> None:
    show(page, engine, snapshot(engine, params=Params(d_min=0.31, footprint=False, mode="sm")))
    assert page.params.controls["d_min"].value == pytest.approx(310.0)
    assert page.params.controls["footprint"].value is False
    assert "SM" in page.control.control.value
    assert engine.posted == []


def test_a_slider_is_not_pulled_back_while_it_is_moved(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    slider = page.params.controls["delta"]
    run(page, slider, 150.0)
    show(page, engine, snapshot(engine))
    assert slider.value == 150.0
    clock.t += HANDS_OFF
    show(page, engine, snapshot(engine))
    assert slider.value == pytest.approx(100.0)


def test_every_setting_has_a_control(page: Page) -> None:
    assert set(page.params.controls) | {"mode"} == {t.name for t in tunables()}


@pytest.mark.parametrize("name", [t.name for t in tunables() if t.low is not None])
def test_both_ends_of_every_slider_are_accepted(page: Page, engine: FakeEngine, name: str) -> None:
    control: Any = page.params.controls[name]
    for end in (control.min, control.max):
        run(page, control, end)
        action = engine.posted[-1]
        assert isinstance(action, SetParams)
        replace(Params(), **action.changes)  # raises where a value is refused


def test_the_control_points_are_chosen_by_name(page: Page, engine: FakeEngine) -> None:
    run(page, page.control.control, "Sensor mounts (SM)")
    assert engine.posted == [SetParams({"mode": "sm"})]


@pytest.mark.parametrize("mode", Mode)
def test_the_state_is_told_in_plain_words(page: Page, engine: FakeEngine, mode: Mode) -> None:
    status = Status(mode, "the <reason>", 0.0)
    show(page, engine, snapshot(engine, status=status))
    assert mode.value.capitalize() in page.control.state.content
    assert "the &lt;reason&gt;" in page.control.state.content


def test_a_refused_action_is_told(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, notice="no such body"))
    assert "Refused: no such body" in page.control.state.content


def test_an_engine_that_falls_silent_is_told(
    page: Page, clock: ManualClock, engine: FakeEngine
) -> None:
    show(page, engine, snapshot(engine))
    clock.t += 3.0
    assert not page.pump.step()
    assert "has not spoken for 3 s" in page.control.state.content


def test_the_plot_holds_half_a_minute(page: Page, engine: FakeEngine) -> None:
    for _ in range(3):
        show(page, engine, snapshot(engine))
    x, distance, d_min, upper, ghost, separation = page.plot.distance.data
    assert len(x) == LENGTH
    assert (x[-1], distance[-1], d_min[-1], upper[-1]) == pytest.approx((0.0, 25.0, 20.0, 30.0))
    assert x[-2] == pytest.approx(-1.0)
    assert (ghost < 0.0).all() and (separation < 0.0).all()  # neither is in use
    assert np.isfinite(np.concatenate(page.plot.distance.data)).all()


def test_a_ghost_is_drawn_translucent_with_its_own_distance(page: Page, engine: FakeEngine) -> None:
    links = np.array(snapshot(engine).T_base_link)
    links[:, 0, 3] += 0.1
    ghost = GhostState("qp", links, 0.4, Command(np.zeros(6)))
    params = Params(separation=True)
    show(page, engine, snapshot(engine, ghost=ghost, params=params))
    assert [h.position[0] for h in page.ghost._links] == pytest.approx(links[:, 0, 3])
    assert all(h.visible for h in page.ghost._links)
    data = page.plot.distance.data
    assert data[4][-1] == pytest.approx(40.0) and data[5][-1] > 10.0
    show(page, engine, snapshot(engine))
    assert not any(h.visible for h in page.ghost._links)


def test_a_pose_is_typed_and_a_program_is_started_and_ended(page: Page, engine: FakeEngine) -> None:
    page.goals.position.value = (500.0, -100.0, 400.0)
    page.goals.rpy.value = (180.0, 0.0, 90.0)
    run(page, page.goals.go, True)
    assert engine.posted == [SetPose((0.5, -0.1, 0.4), (np.pi, 0.0, np.pi / 2))]
    run(page, page.goals.buttons, "Start")
    run(page, page.goals.buttons, "End")
    assert engine.posted[1:] == [RunProgram("screws"), RunProgram("")]
    show(page, engine, snapshot(engine, program="screws 1/2 left, 0 reached"))
    assert "1/2 left" in page.goals.state.content


def test_what_holds_the_arm_back_is_told(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine, advice="slow: the sensors are silent for 0.3 s"))
    assert "silent for 0.3 s" in page.control.state.content


def test_the_plot_draws_an_empty_sky_at_its_top(page: Page, engine: FakeEngine) -> None:
    now = snapshot(engine)
    show(page, engine, replace(now, pairs=nobody(now.pairs)))
    assert page.plot.distance.data[1][-1] == 100.0


def test_the_health_table_counts_the_verdicts(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine))
    text = page.health.table.content
    assert ">no target</td>" in text and f">{64 * SENSORS - 2}</td>" in text
    assert "30 / 30 ms" in text  # ages of the sensors


def test_nothing_is_done_more_often_than_asked() -> None:
    pace = Every(0.25)
    assert [pace.due(t) for t in (0.0, 0.1, 0.24, 0.25, 0.3, 0.1)] == [
        True, False, False, True, False, True,
    ]  # fmt: skip


# --- the pump -------------------------------------------------------------------------------


def test_an_old_snapshot_is_not_shown_twice(page: Page, engine: FakeEngine) -> None:
    show(page, engine, snapshot(engine))
    assert not page.pump.step()


def test_a_frame_stays_far_below_one_window_of_messages(page: Page, engine: FakeEngine) -> None:
    """viser sends at most 128 messages in one window of 1/60 s."""
    for k in range(3):
        q = engine.robot.home + 0.01 * k
        posture = engine.robot.posture(q)
        moved = snapshot(engine, T_base_link=posture.T_base_link, T_base_tool=posture.T_base_tool)
        first = page.server._websock_server._broadcast_buffer.message_counter
        show(page, engine, moved)
        last = page.server._websock_server._broadcast_buffer.message_counter
    assert 0 < last - first < 64


def test_a_failing_view_stops_the_arm(engine: FakeEngine) -> None:
    class Broken:
        def update(self, snapshot: Snapshot) -> None:
            raise ZeroDivisionError("a view is broken")

    class Peopled(SimpleNamespace):
        """A server with a window open, which the pump needs to do anything."""

    told: list[tuple[str, str]] = []
    window = SimpleNamespace(add_notification=lambda *text, color: told.append(text))
    fresh = replace(engine, snapshots=Latest(), posted=[])
    fresh.snapshots.put(snapshot(engine), 0.0)
    with serving(port=0) as server:
        peopled: Any = Peopled(atomic=server.atomic, get_clients=lambda: {0: window})
        pump = Pump(peopled, fresh, [Broken()], ManualClock(), Traffic(server), print)
        with pytest.raises(ZeroDivisionError):
            pump._run()
    (stop,) = fresh.posted
    assert isinstance(stop, SetMode)
    assert stop.mode is Mode.STOPPED
    assert stop.reason == "page: ZeroDivisionError: a view is broken"
    assert isinstance(pump.fault, ZeroDivisionError)
    assert told
