"""The memory of what left the field of view: kept, carved, decayed, bounded."""

from dataclasses import replace

import numpy as np
import pytest

from app.cell.parts import Cell
from app.messages import Verdict
from app.perception.cloud import SkinCloud
from app.perception.memory import CAPACITY, Memory
from app.perception.rules import Rules
from app.robot.skin import build_skin
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.world.motion import Along
from app.world.route import Route
from app.world.shapes import make_shape
from app.world.world import Body, World
from tests.fakes import frame

P = Rules()


class Scene:
    """A skin that looks at a world and remembers."""

    def __init__(self, robot, skin, world, errors=None):
        self.robot, self.skin, self.world = robot, skin, world
        self.eye = SimulatedSkin(robot, skin, world, 1, errors, latency=0.0)
        self.cloud, self.memory = SkinCloud(robot, skin, Cell()), Memory(robot, skin)
        self.t = 0.0

    def run(self, seconds, q, world_time=True):
        posture = self.robot.posture(q)
        for _ in range(round(seconds * 75)):
            self.t += 1 / 75
            if world_time:
                self.world.step(self.t)
            for f in self.eye.poll(self.t, posture):
                self.cloud.add_frames([f], posture, P)
                view = self.cloud.view(self.t)
                self.memory.update(view, np.array([f.sensor]), posture)
            self.memory.age(self.t, posture)

    def held(self, low, high):
        """How many remembered points lie in a box of the base frame."""
        p = self.memory.points[self.memory.use]
        return int(((p >= low) & (p <= high)).all(axis=1).sum())


BACK = {"kind": "box", "size_m": [3.0, 0.05, 3.0]}
PLATE = {"kind": "box", "size_m": [0.8, 0.02, 0.8]}
HERE = ([-1.0, 0.65, -1.0], [1.5, 0.85, 2.0])


@pytest.fixture
def beside(robot, skin):
    """A plate on the left of the forearm, a wall behind it."""
    world = World(())
    world.add("back", BACK, (0.3, 1.3, 0.5))
    world.add("plate", PLATE, (0.35, 0.75, 0.5))
    return Scene(robot, skin, world)


def away(robot):
    """The forearm's sensors look away from the plate."""
    q = robot.home.copy()
    q[0] += np.pi
    return q


def test_a_plate_is_remembered_after_it_has_left_the_view(robot, beside):
    beside.run(1.5, robot.home)
    seen = beside.held(*HERE)
    assert seen > 30
    beside.run(2.5, away(robot))
    assert beside.held(*HERE) > 0.8 * seen


def test_a_plate_that_is_gone_disappears_within_two_frames_of_looking(robot, beside):
    beside.run(1.5, robot.home)
    seen = beside.held(*HERE)
    beside.world.remove("plate")
    beside.run(2.5 / 15, robot.home)
    assert seen > 30 and beside.held(*HERE) <= 0.02 * seen


def test_a_plate_that_is_gone_stays_remembered_while_nobody_looks(robot, skin, beside):
    beside.run(1.5, robot.home)
    seen = beside.held(*HERE)
    beside.world.remove("plate")
    beside.eye.muted.update(range(skin.count))
    beside.run(20.0, robot.home)
    assert beside.held(*HERE) > 0.4 * seen  # what was seen ten times
    beside.run(11.0, robot.home)
    assert beside.held(*HERE) == 0


def test_a_plate_that_stays_is_not_carved_by_noise(robot, beside):
    beside.run(1.5, robot.home)
    seen = beside.held(*HERE)
    beside.run(4.0, robot.home)
    assert beside.held(*HERE) >= seen


def test_the_mean_of_a_wall_is_not_thickened_towards_the_robot(robot, skin):
    world = World(())
    world.add("wall", BACK, (0.3, 0.8, 0.5))
    errors = ErrorModel(bias=0.0)
    scene = Scene(robot, skin, world, errors)
    scene.run(3.0, robot.home)
    points = scene.memory.points[scene.memory.use]
    y = points[(points[:, 1] > 0.6)][:, 1]
    assert np.median(y) == pytest.approx(0.775, abs=0.004)


@pytest.mark.parametrize("background", [True, False])
def test_a_person_who_walks_through_leaves_nothing_after_a_second_and_a_half(
    robot, skin, background
):
    route = Route(np.array([[-1.2, 0.6, 0.0], [2.4, 0.6, 0.0]]), np.array([0.0, 30.0]), 0.9, False)
    torso = make_shape({"kind": "capsule", "radius_m": 0.16, "length_m": 1.2}, None, "torso")
    world = World([Body("torso", torso, (0, 0, 0), Along(route, np.eye(3)), False)])
    if background:
        world.add("back", BACK, (0.3, 1.6, 0.5))
    scene = Scene(robot, skin, world)
    box = ([-1.5, 0.2, -1.0], [1.5, 1.2, 2.0])
    most = 0
    for _ in range(10):
        scene.run(0.4, robot.home)
        most = max(most, scene.held(*box))
    gone = route.at(scene.t).position[0] - 0.16
    assert most > 30 and gone > 1.5
    scene.run(1.5, robot.home)
    assert scene.held(*box) == 0


def test_a_point_seen_once_is_not_remembered(robot, skin):
    cloud, memory = SkinCloud(robot, skin, Cell()), Memory(robot, skin)
    posture = robot.posture(robot.home)
    d = np.full(64, 1.5)
    status = np.full(64, 255)
    d[27], status[27] = 0.5, 5
    blind = P._replace(doubts_ghosts=False)
    for i in range(2):
        one = frame(15, i / 15, d, status=status, targets=(status == 5).astype(int))
        cloud.add_frames([one], posture, blind)
        memory.update(cloud.view(i / 15), np.array([15]), posture)
        assert memory.use.sum() == i  # the second look confirms it


def test_what_the_arm_has_been_at_three_times_is_forgotten(robot, beside):
    beside.run(1.5, robot.home)
    row = int(np.flatnonzero(beside.memory.use)[0])
    for _ in range(3):
        assert beside.memory.use[row]
        beside.memory.visited(np.array([row]))
    for _ in range(8):
        beside.memory.age(beside.t, robot.posture(robot.home))
    assert not beside.memory.use[row]


def test_the_memory_is_bounded(robot, skin):
    rng = np.random.default_rng(2)
    cloud, memory = SkinCloud(robot, skin, Cell()), Memory(robot, skin)
    posture = robot.posture(robot.home)
    view = cloud.view(0.0)
    for i in range(900):
        points = rng.uniform(-1.0, 1.0, (len(view.points), 3))
        crowd = replace(
            view, points=points, verdict=np.zeros(len(points), dtype=np.uint8),
            stamp=np.full(skin.count, i / 1e4),
        )  # fmt: skip
        memory.update(crowd, np.array([3]), posture)
    assert 0.9 * CAPACITY < len(memory.points) <= CAPACITY
    assert memory.use.sum() > 0.5 * CAPACITY
    assert np.isfinite(memory.points[memory.use]).all()


@pytest.mark.parametrize(("rotation", "mirrored"), [(0, False), (90, False), (180, True)])
def test_carving_follows_the_mounting_of_the_sensor(robot, skin, rotation, mirrored):
    """A voxel in one zone's way is carved by that zone and by no other."""
    turned = tuple(replace(s, rotation_deg=rotation, mirrored=mirrored) for s in skin.sensors)
    other = build_skin("turned", turned, robot)
    posture = robot.posture(robot.home)

    def left(zone, looker):
        cloud, memory = SkinCloud(robot, other, Cell()), Memory(robot, other)
        for i in range(5):
            d, status = np.full(64, 1.5), np.full(64, 4)
            if i < 2:
                d[zone], status[zone] = 0.5, 5
            else:
                status[looker] = 5
            cloud.add_frames([frame(15, i / 15, d, status=status)], posture, P)
            memory.update(cloud.view(i / 15), np.array([15]), posture)
        rows = memory.points[memory.use]
        return len(rows[np.linalg.norm(rows - posture.T_base_link[3, :3, 3], axis=1) < 1.0])

    P = Rules(doubts_ghosts=False)
    for zone in (10, 63):
        assert left(zone, zone) == 0
        assert all(left(zone, z) == 1 for z in (0, 7, 29, 34, 56))


def test_what_nobody_has_looked_at_again_is_not_forgotten(robot, skin, beside):
    beside.run(0.25, robot.home)  # too short to be known as standing still
    seen = beside.held(*HERE)
    beside.eye.muted.update(range(skin.count))
    beside.run(6.0, robot.home)
    assert seen > 30 and beside.held(*HERE) > 0.7 * seen
    beside.run(25.0, robot.home)
    assert beside.held(*HERE) == 0


def remembered_later(robot, skin, depth, then):
    """Is a point that one zone saw twice remembered 5 s later, `then` being the zone's status?"""
    cloud, memory = SkinCloud(robot, skin, Cell()), Memory(robot, skin)
    posture, blind = robot.posture(robot.home), Rules(doubts_ghosts=False)
    for i in range(75):
        d, status, targets = np.full(64, depth), np.full(64, 4), np.ones(64, dtype=np.uint8)
        status[27] = 5 if i < 2 else then
        targets[27] = status[27] != 255
        cloud.add_frames([frame(15, i / 15, d, status=status, targets=targets)], posture, blind)
        memory.update(cloud.view(i / 15), np.array([15]), posture)
        for _ in range(8):
            memory.age(i / 15, posture)
        assert memory.use.sum() == 1 or i != 2
    return bool(memory.use.any())


BAD, NO_ECHO = 4, 255


def test_what_was_looked_at_and_not_seen_again_is_forgotten_soon(robot, skin):
    assert remembered_later(robot, skin, 0.8, BAD)  # the zone has not seen that far
    assert not remembered_later(robot, skin, 0.8, NO_ECHO)


@pytest.mark.parametrize(("before", "remembered"), [(0.015, False), (0.25, True)])
def test_what_may_be_the_arm_itself_is_never_remembered(robot, skin, before, remembered):
    """A point before the upper arm, kept in three frames."""
    posture, link = robot.posture(robot.home), robot.link_index("upper_arm_link")
    vertices, T = robot.bodies[link].vertices, robot.posture(robot.home).T_base_link[link]
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    middle[2] = vertices[:, 2].max() + before
    memory, view = Memory(robot, skin), SkinCloud(robot, skin, Cell()).view(0.0)
    points, verdict = view.points.copy(), np.full(skin.slots, Verdict.EMPTY, dtype=np.uint8)
    points[64 * 3 + 27], verdict[64 * 3 + 27] = T[:3, :3] @ middle + T[:3, 3], Verdict.KEPT
    for i in range(3):
        seen = replace(
            view, points=points, verdict=verdict, eps=np.full(skin.slots, 0.01),
            stamp=np.full(skin.count, i / 15),
        )  # fmt: skip
        memory.update(seen, np.array([3]), posture)
    assert memory.use.any() == remembered


def test_what_is_known_to_stand_still_is_as_old_as_its_last_sight(robot, skin, beside):
    beside.run(1.5, robot.home)
    rows, now = np.flatnonzero(beside.memory.use), beside.t
    beside.eye.muted.update(range(skin.count))
    beside.run(4.0, robot.home)
    left = rows[beside.memory.use[rows]]
    assert len(left) > 30
    ages = beside.t - beside.memory.seen[left]
    assert (ages >= beside.t - now - 1e-9).all() and (ages < 30.0).all()
