"""The cell bounds the motion: whatever is known is never driven into, seen or not."""

import numpy as np
import pytest

from app.cell.files import load_cell
from app.cell.learned import Learned, cubes_at
from app.cell.parts import Box, Cell, HalfSpace
from app.config import Params
from app.judge.truth import TrueDistance
from app.messages import Goal, Pairs, freeze
from app.poses import transform
from app.robot.arm import SimulatedArm
from app.robot.model import find_robot, load_robot
from app.robot.tables import Choice
from app.world.cells import find_cell, read_cell
from app.world.motion import Still
from app.world.shapes import make_shape
from app.world.world import Body, World
from tests.alone import alone

DT = 0.01  # [s]
NOTHING = Pairs(
    np.empty(0, np.intp), np.empty(0), *np.empty((3, 0, 3)), np.empty(0, np.intp), -1
)  # fmt: skip
FAST = Params(mode="qp", goal_speed=1.0, joint_speed=1.0)


def plane(z, size=(2.0, 2.0), rpy=(0.0, 0.0, 0.0)):
    T = transform(np.array([0.0, 0.0, z]), np.array(rpy))
    return HalfSpace("floor", T, np.array(size))


def drive(robot, cell, place, seconds=12.0, params=FAST, begin=None, learn=None):
    """Postures on the way to a goal at `place` [m] that nothing is perceived of."""
    control, arm = alone(robot, "qp", cell), SimulatedArm(robot, begin)
    if learn is not None:
        control.clearance.know(learn)
    T = robot.posture(arm.state(0.0).q).T_base_tool.copy()
    T[:3, 3] = place
    for i in range(round(seconds / DT)):
        state = arm.state(i * DT)
        posture = robot.posture(state.q)
        arm.send(control.update(posture, state, NOTHING, Goal(T), params, DT).qd, DT)
        yield posture


def height(robot, posture, T_base_plane=None):
    """[m] of the lowest vertex of what moves, above the base or a plane."""
    T = np.linalg.inv(np.eye(4) if T_base_plane is None else T_base_plane)
    poses = [(T @ t)[2] for t in posture.T_base_link]
    heights = [
        (body.vertices @ z[:3] + z[3]).min()
        for body, z, moves in zip(robot.bodies, poses, robot.supports.any(axis=1), strict=True)
        if moves
    ]
    return min(heights)


@pytest.mark.parametrize("place", [[0.3, 0.17, -0.3], [0.0, 0.6, -0.3], [0.7, -0.3, -0.3]])
def test_a_goal_below_the_bench_is_never_reached(robot, place):
    cell = load_cell(find_cell("bench"))
    assert min(height(robot, p) for p in drive(robot, cell, place)) > 0.0


def test_a_goal_below_the_table_is_never_reached(robot):
    """The table ends 0.46 m ahead; the goal is under it."""
    cell = read_cell(find_cell("table"))
    assert min(height(robot, p) for p in drive(robot, cell, [0.3, 0.0, -0.3])) > 0.0


def test_a_plane_bounds_far_beyond_the_patch_that_is_drawn(robot):
    """And where it leans, too: the arm is fully stretched over it."""
    floor = plane(-0.05, size=(0.1, 0.1), rpy=(0.0, 0.1, 0.0))
    way = list(drive(robot, Cell(planes=(floor,)), [1.0, 0.5, -0.6]))
    assert way[-1].T_base_tool[0, 3] > 0.7
    assert min(height(robot, p, floor.T_base_plane) for p in way) > 0.0


def test_a_home_posture_near_the_table_leaves_the_table_a_bound():
    choice = Choice(home_deg=(0.0, -60.0, 130.0, -160.0, -90.0, 0.0))
    robot = load_robot(find_robot("ur10e"), choice)
    home = robot.posture(robot.home)
    top = height(robot, home) - 0.015
    T = transform(np.array([0.6, 0.1, top - 0.05]), np.zeros(3))
    cell = Cell(boxes=(Box("table", T, np.array([1.0, 1.0, 0.1])),))
    place = home.T_base_tool[:3, 3] - [0.0, 0.0, 0.3]
    low = min(height(robot, p) for p in drive(robot, cell, place, 5.0))
    assert top < low


@pytest.mark.parametrize("known_at_first", [True, False])
def test_a_learned_post_bounds_the_motion_though_it_makes_no_points(robot, known_at_first):
    shape = make_shape({"kind": "cylinder", "radius_m": 0.05, "length_m": 1.2}, None, "post")
    T = transform(np.array([0.45, -0.35, 0.5]), np.zeros(3))
    world = World([Body("post", shape, (0, 0, 0), Still(freeze(T)))])
    angle, z = np.meshgrid(np.linspace(0, 2 * np.pi, 40), np.linspace(-0.6, 0.6, 60))
    surface = np.stack((0.05 * np.cos(angle), 0.05 * np.sin(angle), z), axis=-1).reshape(-1, 3)
    learned = Learned.of(cubes_at(surface + T[:3, 3]))
    truth = TrueDistance([(b.vertices, b.faces) for b in robot.bodies])
    kinds = (
        {"cell": Cell(learned=learned)} if known_at_first else {"cell": Cell(), "learn": learned}
    )
    way = list(drive(robot, place=[0.35, -0.7, 0.5], seconds=8.0, **kinds))
    least = min(truth.measure(p.T_base_link, world).min() for p in way[::4])
    assert 0.0 < least < 0.12
    free = list(drive(robot, Cell(), [0.35, -0.7, 0.5], 8.0))
    assert min(truth.measure(p.T_base_link, world).min() for p in free[::4]) < 0.0


def test_what_was_learned_can_be_forgotten(robot):
    place = [0.55, -0.4, 0.6]
    wall = Learned.of(cubes_at(np.array(place) + [[0.05 * i, 0.0, 0.0] for i in range(-4, 4)]))
    control, ends = alone(robot), []
    for learned in (wall, Learned.of(np.empty((0, 3), dtype=np.int64))):
        control.clearance.know(learned)
        control.reset()
        arm = SimulatedArm(robot)
        T = robot.posture(robot.home).T_base_tool.copy()
        T[:3, 3] = place
        for i in range(800):
            state = arm.state(i * DT)
            posture = robot.posture(state.q)
            arm.send(control.update(posture, state, NOTHING, Goal(T), FAST, DT).qd, DT)
        ends.append(np.linalg.norm(posture.T_base_tool[:3, 3] - place))
    assert ends[0] > 0.05 and ends[1] < 0.01
