"""The oracle: it knows what is near, where and how fast, and no controller is told otherwise."""

import numpy as np
import pytest

from app.config import Params
from app.errors import StudyError
from app.judge.sampling import surface_points
from app.judge.truth import TrueDistance
from app.messages import JointState
from app.needs import Needs
from app.poses import transform
from app.studies.oracle import SPACING, TruePerception
from app.studies.random_scene import random_world
from app.world.motion import motion_of
from app.world.shapes import make_shape
from app.world.tables import LineMotion
from app.world.world import Body, World

UP = np.array([0.0, 0.0, 1.0])
SEVERAL = Needs("several", 0.6)
SHAPES = [
    {"kind": "box", "size_m": (0.4, 0.1, 0.2)},
    {"kind": "sphere", "radius_m": 0.1},
    {"kind": "capsule", "radius_m": 0.08, "length_m": 0.5},
]


def perceived(oracle, robot, q, now=0.0, needs=SEVERAL):
    joints = JointState(now, q, np.zeros(robot.n))
    return oracle.update((), joints, robot.posture(q), Params(), needs, 0.01, lambda room: None)


@pytest.mark.parametrize("table", SHAPES)
def test_no_point_of_a_surface_is_farther_from_a_sample_than_they_are_apart(table):
    shape, rng = make_shape(table, None, "shape"), np.random.default_rng(1)
    corners = shape.vertices[shape.faces]
    area = np.linalg.norm(np.cross(*np.diff(corners, axis=1).swapaxes(0, 1)), axis=1)
    chosen = corners[rng.choice(len(corners), 500, p=area / area.sum())]
    points = np.einsum("ni,nij->nj", rng.dirichlet(np.ones(3), 500), chosen)
    samples = surface_points(shape.vertices, shape.faces, SPACING)
    gaps = np.linalg.norm(points[:, None] - samples[None], axis=2).min(axis=1)
    assert gaps.max() < 1.1 * SPACING and len(samples) < 2000


def test_it_knows_the_distance_of_every_link(robot, skin):
    truth, moving = TrueDistance([(b.vertices, b.faces) for b in robot.bodies]), 0
    for seed in range(8):
        rng = np.random.default_rng([seed, 5])
        world = random_world(robot, truth, rng)
        seen = perceived(TruePerception(robot, skin, world), robot, robot.home)
        true = truth.measure(robot.posture(robot.home).T_base_link, world)
        near = true < 0.6
        assert (seen.body.distance > true - 1e-3).all()  # a round mesh is inscribed
        # beside the foot by their spacing, and below it where the surface is round
        assert (seen.body.distance[near] < true[near] + 0.01).all()
        moving += int(near.sum())
    assert moving > 5


def test_it_knows_how_fast_a_body_comes(robot, skin):
    tool = robot.posture(robot.home).T_base_tool[:3, 3]
    T = transform(tool - 0.4 * UP, np.zeros(3))
    up = LineMotion(tuple((tool + UP).tolist()), 0.3)
    shape = make_shape({"kind": "sphere", "radius_m": 0.1}, None, "ball")
    world = World([Body("ball", shape, (0, 0, 0), motion_of(up, T, "ball"))])
    oracle = TruePerception(robot, skin, world)
    world.step(1.0)  # it has gathered its speed by then
    assert not perceived(oracle, robot, robot.home, 1.0).pairs.approach.any()
    world.step(1.01)
    pairs = perceived(oracle, robot, robot.home, 1.01).pairs
    seen = pairs.slot >= 0
    assert pairs.approach[seen] == pytest.approx(0.3 * pairs.normal[seen, 2].clip(-2 / 3), abs=1e-6)
    oracle.reset()
    assert not perceived(oracle, robot, robot.home, 1.02).pairs.approach.any()


def test_it_serves_only_who_wants_several_pairs(robot, skin):
    with pytest.raises(StudyError, match="several"):
        perceived(
            TruePerception(robot, skin, World(())), robot, robot.home, needs=Needs("links", 1)
        )
