"""Two distances: what can give way and what cannot; and the controller's own words."""

from dataclasses import replace

import numpy as np
import pytest

from app.config import Params
from app.control.nearness import ABLE, nearness
from app.messages import Command, Goal, Mode, Pairs, Snapshot, Status
from app.near import NOT_NEAR, NOTHING_NEAR, Near, Nearness
from app.robot.model import Robot
from app.robot.posture import Posture
from app.ui.colours import ALARM, CALM, NEAR, WARN
from app.ui.reading import STAYS, Reading, near_colour
from app.ui.words import (
    closest_words,
    doing_words,
    fixed_words,
    link_words,
    pace_words,
    state_words,
    why_fixed,
    yielding_words,
)
from tests.ui_page import FakeEngine, snapshot, the_engine  # noqa: F401 - fixtures

UP = np.array([0.0, 0.0, 1.0])
OUT = np.array([-1.0, 0.0, 0.0])


@pytest.fixture
def links(robot: Robot) -> list[str]:
    return [link_words(link) for link in robot.links]


def pairs_of(robot: Robot, *rows: tuple[str, float, np.ndarray, np.ndarray]) -> Pairs:
    """Rows of a link, a distance [m], the robot's point and the direction of retreat."""
    link = np.array([robot.links.index(name) for name, *_ in rows], dtype=np.intp)
    distance = np.array([d for _, d, _, _ in rows])
    on_robot, normal = np.array([p for _, _, p, _ in rows]), np.array([n for *_, n in rows])
    on_world = on_robot - distance[:, None] * normal
    return Pairs(link, distance, on_robot, on_world, normal, np.zeros(len(rows), np.intp), 0)


def seen(robot: Robot, pairs: Pairs, row: int = -1, blocked: float = 0.0) -> Nearness:
    posture: Posture = robot.posture(robot.home)
    goal = posture.T_base_tool.copy()
    goal[0, 3] += 0.62
    return nearness(pairs, pairs, row, posture, robot.qd_max, Goal(goal), blocked)


def tool_row(robot: Robot, distance: float) -> tuple[str, float, np.ndarray, np.ndarray]:
    T = robot.posture(robot.home).T_base_tool
    return robot.links[-1], distance, T[:3, 3], OUT


def test_the_shoulder_cannot_leave_and_the_wrist_can(robot: Robot) -> None:
    beside = ("shoulder_link", 0.09, np.array([0.09, 0.0, 0.18]), OUT)
    near = seen(robot, pairs_of(robot, beside, tool_row(robot, 0.27)))
    assert (near.yields.distance, near.stays.distance) == (0.27, 0.09)
    assert near.stays.speed < ABLE < near.yields.speed
    assert robot.links[near.stays.link] == "shoulder_link"


def test_the_closest_of_each_kind_is_told_wherever_it_stands(robot: Robot) -> None:
    rows = [tool_row(robot, d) for d in (0.5, 0.3, 0.4)]
    near = seen(robot, pairs_of(robot, *rows))
    assert near.yields.distance == 0.3 and not near.stays.seen


def test_the_base_is_neither(robot: Robot) -> None:
    base = (robot.links[0], 0.05, np.zeros(3), UP)
    near = seen(robot, pairs_of(robot, base))
    assert not near.yields.seen and not near.stays.seen


def test_a_link_without_a_pair_is_not_near(robot: Robot) -> None:
    nowhere = (robot.links[-1], np.inf, np.full(3, np.nan), np.full(3, np.nan))
    near = seen(robot, pairs_of(robot, nowhere))
    assert near.yields is NOT_NEAR and near.stays is NOT_NEAR


def test_what_the_avoidance_acts_on_is_told_with_the_way_to_go(robot: Robot) -> None:
    near = seen(robot, pairs_of(robot, tool_row(robot, 0.26)), row=0, blocked=4.2)
    assert robot.links[near.holder] == robot.links[-1]
    assert (near.held_at, near.blocked) == (0.26, 4.2)
    assert near.to_go == pytest.approx(0.62)


# --- words ---------------------------------------------------------------------------------


def near_at(distance: float, link: int = 3) -> Near:
    return Near(link, distance, 1.0, np.zeros(3), np.ones(3), OUT)


def told(engine: FakeEngine, command: Command, near: Nearness, mode: Mode = Mode.RUNNING) -> str:
    now = snapshot(engine, command=command, nearness=near, status=Status(mode, "", 0.0))
    return doing_words(now, [link_words(link) for link in engine.robot.links])


@pytest.mark.parametrize(
    "activation, reference, holder, blocked, words",
    [
        (0.0, 0.0, -1, 0.0, "Free"),
        (1.0, -0.1, 7, 0.0, "Slowed by wrist 3 at 28 cm"),
        (1.0, 0.1, 7, 0.0, "Pushed back by wrist 3 at 28 cm"),
        (1.0, 0.0, -1, 0.0, "Slowed by its own body or the cell"),
        (1.0, -0.1, 7, 4.3, "Blocked by wrist 3 at 28 cm, since 4 s, goal 62 cm away"),
        (0.0, 0.0, -1, 4.3, "Blocked, since 4 s, goal 62 cm away"),
    ],
)
def test_the_controller_says_what_it_does(
    engine: FakeEngine, activation: float, reference: float, holder: int, blocked: float, words: str
) -> None:
    near = Nearness(holder=holder, held_at=0.28, blocked=blocked, to_go=0.62)
    command = Command(np.zeros(6), activation=activation, reference=reference)
    assert told(engine, command, near) == words
    for mode in (Mode.STOPPED, Mode.IDLE):
        assert told(engine, command, near, mode) == ""


def test_a_goal_that_is_only_turned_away_is_not_told_in_centimetres(engine: FakeEngine) -> None:
    near = Nearness(holder=7, held_at=0.28, blocked=2.0, to_go=0.01)
    words = told(engine, Command(np.zeros(6), activation=1.0), near)
    assert words == "Blocked by wrist 3 at 28 cm, since 2 s"


def test_both_distances_are_words(robot: Robot, links: list[str]) -> None:
    assert yielding_words(near_at(0.27), links, 0.25) == "Forearm, 27 cm (keeps 25): can give way"
    assert yielding_words(near_at(0.20), links, 0.25) == "Forearm, 20 cm: closer than kept (25)"
    assert yielding_words(near_at(0.245), links, 0.25).endswith("can give way")
    assert yielding_words(near_at(0.20), links, None) == "Forearm, 20 cm: can give way"
    assert yielding_words(NOT_NEAR, links, 0.25).startswith("Nothing in sight")
    reasons = why_fixed(robot)
    assert fixed_words(near_at(0.09, 1), links, reasons).endswith("can only turn about the base")
    assert fixed_words(NOT_NEAR, links, reasons) == ""


def test_a_film_tells_both_in_one_line(engine: FakeEngine, links: list[str]) -> None:
    now = snapshot(engine)
    assert closest_words(now, links) == "25 cm at the forearm · slowed by its own body or the cell"
    assert closest_words(replace(now, nearness=NOTHING_NEAR), links).startswith("Nothing in")


def test_blocked_is_said_once(engine: FakeEngine) -> None:
    advice = "blocked: something stands between the tool and its goal"
    now = snapshot(engine, advice=advice, nearness=Nearness(blocked=3.0))
    assert advice not in state_words(now)[1]
    assert advice in state_words(replace(now, nearness=NOTHING_NEAR))[1]


@pytest.mark.parametrize(
    "rate, late, delay, words",
    [
        (250.0, 0.0, 0.05, ""),
        (72.0, 0.1, 0.3, "Slow computer: 72 of 250 Hz"),
        (248.0, 0.012, 0.05, "Late loop: begins 12 ms late"),
        (248.0, 0.001, 0.23, "Old data: the sensors are 230 ms behind"),
    ],
)
def test_what_is_slow_late_or_old_is_said(
    rate: float, late: float, delay: float, words: str
) -> None:
    assert pace_words(rate, 250.0, late, delay) == words
    assert "computer" not in pace_words(rate, 0.0, late, delay)  # of a recording nobody knows


def test_a_colour_is_of_what_is_promised() -> None:
    assert near_colour(NOT_NEAR, 0.25, 0.0) == CALM
    assert near_colour(near_at(0.30), 0.25, 0.0) == CALM
    assert near_colour(near_at(0.30), 0.25, 1.0) == NEAR
    assert near_colour(near_at(0.20), 0.25, 1.0) == WARN
    assert near_colour(near_at(0.20), None, 1.0) == NEAR
    assert near_colour(near_at(0.01), 0.25, 1.0) == ALARM


# --- one pace ------------------------------------------------------------------------------


def at(now: Snapshot, seconds: float, near: Near) -> Snapshot:
    return replace(now, stamp=seconds, nearness=Nearness(near), params=Params())


def test_a_link_keeps_the_headline_for_half_a_second(engine: FakeEngine) -> None:
    reading, now = Reading(engine.robot), snapshot(engine)
    shown = []
    for k in range(60):  # thirty times a second another link is nearest
        reading.update(at(now, k / 30.0, near_at(0.25, 3 + k % 2)))
        shown.append(reading.yields.link)
    changes = np.flatnonzero(np.diff(shown))
    assert 1 <= len(changes) <= 4
    assert (np.diff(changes) >= STAYS * 30.0 - 1).all()


def test_the_distance_of_a_link_that_stays_is_told_five_times_a_second(engine: FakeEngine) -> None:
    reading, now = Reading(engine.robot), snapshot(engine)
    told = []
    for k in range(30):
        reading.update(at(now, k / 30.0, near_at(0.5 - k / 100.0)))
        told.append(reading.yields.distance)
    assert 4 <= len(set(told)) <= 6
    assert reading.anew == len(set(told))


def test_each_tick_of_a_recording_is_read_by_itself(engine: FakeEngine) -> None:
    reading, now = Reading(engine.robot, stays=0.0), snapshot(engine)
    for k, link in enumerate((3, 4, 3)):
        reading.update(at(now, 0.5 * k, near_at(0.25, link)))
        assert reading.yields.link == link
