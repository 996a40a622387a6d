"""Dirty windows: what they make of the arm's own body holds nothing, and hands are still seen."""

from dataclasses import replace

import numpy as np
import pytest

from app.cell.parts import Cell
from app.messages import Verdict
from app.perception.cloud import SkinCloud
from app.perception.placing import Lenses, Reports
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter
from app.perception.things import find_thin
from app.perception.unable import Unable
from app.perception.windows import SURE, WAY, DirtyWindows, Sight
from app.robot.arm import SimulatedArm
from app.sensing.budget import HONEST
from app.sensing.simulated import SimulatedSkin
from app.studies.headless import step_until
from app.studies.random_scene import random_goal
from app.timing import ManualClock
from app.wiring import Start, assemble
from app.world.world import World
from tests.fakes import frame

P = Rules(doubts_hoses=False)
K, ZONE = 15, 27  # a sensor that looks away from the arm at home


def folded(robot, turn=0.0):
    """The forearm before the upper arm."""
    q = robot.home.copy()
    q[2] = 2.6 - turn
    return q


class Sensor:
    """One sensor, of which one zone alone sees something that may be drawn from the body."""

    def __init__(self, robot, skin):
        self.robot, self.skin, self.windows = robot, skin, DirtyWindows(skin)
        self.lenses = Lenses(
            skin.first, skin.link.astype(np.int64), skin.origin, skin.reach, skin.traits.limits,
            skin.traits.worth,
        )  # fmt: skip
        self.slot, self.k, self.frames = 64 * K + ZONE, K, 0
        self.behind = int(skin.link[K])

    def place(self, away, q):
        """(3,) [m] of what the zone sees so far away, base frame."""
        T = self.robot.posture(q).T_base_link[self.skin.link[K]]
        p = self.skin.origin[K] + away * self.skin.reach[self.slot]
        return T[:3, :3] @ p + T[:3, 3]

    def away(self, place, q):
        """[m] of a place, as far as it is in the zone's middle."""
        u = self.place(1.0, q) - self.place(0.0, q)
        return u @ (place - self.place(0.0, q)) / (u @ u)

    def sees(self, place, q, drawn=True):
        """The verdict when the zone sees something at a place, None: nothing."""
        self.frames += 1
        S = self.skin.slots
        points, verdict = np.full((S, 3), np.nan), np.full(S, Verdict.NO_TARGET, dtype=np.uint8)
        reports = Reports(np.ones(S), np.full(S, 5, dtype=np.uint8), np.zeros(S, dtype=np.uint8))
        if place is not None:
            points[self.slot], verdict[self.slot] = place, Verdict.KEPT
            reports.distance[self.slot], reports.targets[self.slot] = self.away(place, q), 1
        stamp = np.full(self.skin.count, self.frames / 15)
        sight = Sight(points, stamp, self.robot.posture(q).T_base_link)
        behind = np.full(S, self.behind if drawn else -1, dtype=np.int16)
        self.windows.mark(np.array([K]), behind, sight, reports, self.lenses, verdict)
        return Verdict(verdict[self.slot])


def test_what_jumps_is_never_believed_and_names_the_window(robot, skin):
    sensor, q = Sensor(robot, skin), robot.home
    jumps = (0.10, 0.16, None, 0.09, 0.14)
    seen = [sensor.sees(z and sensor.place(z, q), q) for z in jumps]
    assert Verdict.KEPT not in seen and sensor.windows.dirty[K]
    assert sensor.sees(sensor.place(0.2, q), q) == Verdict.SELF


def test_what_rides_with_the_arm_is_not_believed(robot, skin):
    sensor = Sensor(robot, skin)
    for i in range(30):
        q = robot.home + 0.01 * i
        assert sensor.sees(sensor.place(0.12, q), q) == Verdict.GHOST


@pytest.mark.parametrize("dirty", [False, True])
def test_what_stands_is_believed_when_the_arm_has_come_nearer(robot, skin, dirty):
    """After two frames and the way, and behind a dirty window after twice the way."""
    sensor, q = Sensor(robot, skin), robot.home.copy()
    sensor.windows.dirty[:] = dirty
    sensor.windows._windows.signs[:] = 5.0 * dirty
    place, seen, lens = sensor.place(0.3, q), [], sensor.place(0.0, q)
    for _ in range(30):
        seen.append(sensor.sees(place, q))
        if seen[-1] == Verdict.KEPT:
            break
        q = q + 0.02 * np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    way = np.linalg.norm(sensor.place(0.0, q) - lens)
    assert seen[-1] == Verdict.KEPT and len(seen) >= SURE
    most = 1.0 + dirty
    assert most * WAY < way < most * (WAY + 0.1 * 0.35) + 0.02


def test_what_stands_before_an_outline_that_stands_as_well_is_not_believed(robot, skin):
    """The forearm turns, and the upper arm does not: what a window makes of it stays too."""
    sensor, q = Sensor(robot, skin), robot.home.copy()
    sensor.behind = robot.link_index("upper_arm_link")
    place = sensor.place(0.3, q)
    for _ in range(30):
        assert sensor.sees(place, q) == Verdict.GHOST
        q = q + 0.02 * np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def test_what_was_seen_beside_the_body_is_believed_before_it(robot, skin):
    sensor, q = Sensor(robot, skin), robot.home
    place = sensor.place(0.12, q)
    assert sensor.sees(place, q, drawn=False) == Verdict.KEPT
    assert [sensor.sees(place, q) for _ in range(3)] == [Verdict.KEPT] * 3


def test_what_is_drawn_lies_before_an_outline_of_the_body(robot, skin):
    judge, everyone, posture = SelfFilter(robot, skin), np.arange(skin.count), folded(robot)
    posture, near = robot.posture(posture), np.full(skin.slots, 0.05)
    judged = judge.judge(everyone, near, posture, P)
    drawn = judge.drawn(everyone, np.ones(skin.slots, dtype=bool), near, judged) >= 0
    one = judge.judge(everyone, np.full(skin.slots, 9.0), posture, P._replace(footprint=False))
    body = (9.0 + one.gap).reshape(-1, 8, 8)  # before the zones' middles
    k = int(np.argmax(((body > 0.08) & (body < 0.2)).sum(axis=(1, 2))))
    sees, drawn = np.isfinite(body[k]), drawn.reshape(-1, 8, 8)[k]
    across = sees[:, 1:] != sees[:, :-1]
    assert across.sum() > 5 and drawn[:, 1:][across].all() and drawn[:, :-1][across].all()
    inside = np.array([[sees[r - 1 : r + 2, c - 1 : c + 2].all() for c in range(1, 7)]
                       for r in range(1, 7)])  # fmt: skip
    assert inside.sum() > 10 and drawn[1:7, 1:7][inside].mean() < 0.5  # but for steep ones


def test_a_lone_zone_that_sees_the_window_itself_names_it_and_a_finger_on_it_does_not(robot, skin):
    q, cloud = robot.home, SkinCloud(robot, skin, Cell())
    for i in range(6):
        one, two = np.full(64, 1.0), np.full(64, 1.0)
        one[20 + i] = two[20:24] = 0.01
        cloud.add_frames([frame(15, i / 15, one), frame(16, i / 15, two)], robot.posture(q), P)
    assert cloud.unable[15] == Unable.DIRTY_WINDOW and cloud.unable[16] == Unable.SEES
    for i in range(60):
        cloud.add_frames([frame(15, 1.0 + i, 1.0)], robot.posture(q), P)
    assert cloud.unable[15] == Unable.SEES  # it was wiped


def test_a_thing_of_two_by_two_zones_is_not_thin():
    z, grid, thin = np.full(64, 0.3), np.array([8, 8]), np.zeros(64, dtype=bool)
    kept = np.zeros(64, dtype=bool)
    kept[[0, 9, 18, 27, 40, 41]] = True  # along a line, and two beside one another
    assert find_thin(z, kept, kept, grid, thin) == 6 and thin[kept].all()
    kept[[48, 49]] = True
    assert find_thin(z, kept, kept, grid, thin) == 4 and not thin[[40, 41, 48, 49]].any()
    z[49] = 0.2  # as far apart, no side of one thing
    assert find_thin(z, kept, kept, grid, thin) == 8


@pytest.mark.parametrize("seed", [17, 5])
def test_a_dirty_window_alone_never_holds_the_arm(robot, skin, seed):
    """Its sensor is named, and no clean one ever is."""
    eye = SimulatedSkin(robot, skin, World(()), seed, budget=HONEST)
    arm = SimulatedArm(robot, noise=eye.truth.encoders, seed=seed)
    goal = random_goal(robot, np.random.default_rng([seed, 11]))
    engine = assemble(
        robot, skin, arm, eye, World(()), ManualClock(), Start(goal=goal), 125.0
    )  # fmt: skip
    named, held = np.zeros(skin.count, dtype=bool), 0

    def watch(s):
        nonlocal held
        named[:] |= s.unable == Unable.DIRTY_WINDOW
        held += s.command.activation > 0.0 and s.command.control_row >= 0

    step_until(engine, 2.5, watch)
    dirty = eye._measurement._sight.window > 0.0
    assert held == 0
    assert named.any() and not named[~dirty].any()


@pytest.mark.parametrize("cover", [0.0, 30.0])  # clean windows, and all of them dirty
def test_a_hand_that_enters_near_the_upper_arm_is_kept_within_two_frames(robot, skin, cover):
    q = folded(robot, 0.6)
    upper = robot.posture(q).T_base_link[robot.link_index("upper_arm_link")]
    fore = robot.posture(q).T_base_link[robot.link_index("forearm_link")]
    between = 0.55 * upper[:3, 3] + 0.45 * fore[:3, 3]
    world = World(())
    world.add("", {"kind": "box", "size_m": [0.09, 0.18, 0.03]}, tuple(between))
    eye = SimulatedSkin(
        robot, skin, world, 3, latency=0.0, budget=replace(HONEST, cover=cover)
    )  # fmt: skip
    kept = []
    for rules in (Rules(doubts_windows=False), Rules()):
        cloud, posture = SkinCloud(robot, skin, Cell()), eye.truth.robot.posture(q)
        for i in range(2):
            cloud.add_frames(
                eye._measurement.frames(range(skin.count), posture.T_base_link, i / 15),
                robot.posture(q), rules,
            )  # fmt: skip
        kept.append(np.count_nonzero(cloud.newest().verdict == Verdict.KEPT))
    assert kept[0] > 10 and kept[1] > 0.8 * kept[0]


def test_frames_in_a_row_are_two_of_delay():
    assert SURE == 3
