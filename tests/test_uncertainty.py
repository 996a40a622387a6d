"""Propagated uncertainty beside what comes out when the errors are really made."""

from dataclasses import replace

import numpy as np
import pytest

from app.messages import Pairs
from app.perception.uncertainty import FRAME_ANGLE, known_of, pair_sigmas
from app.robot.doubt import Doubt
from app.robot.posture import rotation_matrix
from app.robot.skin import build_skin

STEP = 1e-6


def doubt(K, position=0.0, angle=0.0, share=0.0, time=0.0, joint=0.0):
    return Doubt(*(np.full(K, x) for x in (position, angle, share, time)), joint)


@pytest.fixture
def pair(robot, skin):
    """Posture, joint speed and pairs of points that zones saw, with the upper arm and a wrist."""
    rng = np.random.default_rng(3)
    posture = robot.posture(robot.home + rng.uniform(-0.5, 0.5, robot.n))
    qd, slots = rng.uniform(-1.0, 1.0, robot.n), rng.integers(0, skin.slots, 6)
    points = np.array([point(robot, skin, posture.q, s, 0.4) for s in slots])
    links = np.array([robot.link_index(n) for n in ("upper_arm_link", "wrist_2_link")] * 3)
    on_robot = posture.T_base_link[links][:, :3, 3] + 0.03
    normals = rng.normal(size=(6, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    distance = np.einsum("ij,ij->i", on_robot - points, normals)
    return posture, qd, Pairs(links, distance, on_robot, points, normals, slots, 0)


def point(robot, skin, q, slot, distance):
    k = skin.sensor_of[slot]
    T = robot.posture(q).T_base_link[skin.link[k]]
    return T[:3, :3] @ (skin.origin[k] + distance * skin.reach[slot]) + T[:3, 3]


def sigmas(robot, skin, pair, **what):
    """Of a skin with this doubt; the joints' frames and the noise of the range left out."""
    posture, qd, pairs = pair
    doubted = replace(skin, doubt=doubt(skin.count, **what))
    known = known_of(doubted)
    known = known._replace(
        noise=np.zeros_like(known.noise), joint=np.array([what.get("joint", 0.0)])
    )
    return pair_sigmas(known, pairs, posture, qd)


def slopes(change, pairs):
    """(6, errors) change of the points along the normals for unit errors."""
    return np.stack(
        [np.einsum("ij,ij->i", (change(e, STEP) - change(e, 0.0)) / STEP, pairs.normal)
         for e in range(change.errors)], axis=1,
    )  # fmt: skip


def norm_of(change, errors, pairs):
    change.errors = errors
    return np.linalg.norm(slopes(change, pairs), axis=1)


def test_a_mounting_error_moves_a_point_as_far_as_is_said(robot, skin, pair):
    posture, _, pairs = pair

    def moved(axis, size):
        D = np.eye(4)
        if axis < 3:
            D[axis, 3] = size
        else:
            D[:3, :3] = rotation_matrix(size * np.eye(3)[axis - 3])
        sensors = tuple(replace(s, T_link_sensor=s.T_link_sensor @ D) for s in skin.sensors)
        other = build_skin("", sensors, robot)
        return np.array([point(robot, other, posture.q, s, 0.4) for s in pairs.slot])

    both = norm_of(moved, 6, pairs)
    assert np.hypot(
        sigmas(robot, skin, pair, position=1.0), sigmas(robot, skin, pair, angle=1.0)
    ) == pytest.approx(both, rel=1e-4)


def test_a_late_stamp_moves_a_point_as_far_as_its_link_moves(robot, skin, pair):
    posture, qd, pairs = pair

    def moved(_, late):
        return np.array([point(robot, skin, posture.q + late * qd, s, 0.4) for s in pairs.slot])

    assert sigmas(robot, skin, pair, time=1.0) == pytest.approx(norm_of(moved, 1, pairs), rel=1e-4)


def test_a_range_error_moves_a_point_along_its_ray(robot, skin, pair):
    posture, _, pairs = pair

    def moved(_, size):
        return np.array([point(robot, skin, posture.q, s, 0.4 * (1.0 + size)) for s in pairs.slot])

    assert sigmas(robot, skin, pair, share=1.0) == pytest.approx(norm_of(moved, 1, pairs), rel=1e-4)


def test_joints_count_only_between_the_sensor_and_the_body(robot, skin, pair):
    posture, _, pairs = pair

    def moved(joint, size):
        """The seen point as its sensor carries it, less the body's point as its link does."""
        q = posture.q + size * np.eye(robot.n)[joint]
        T, T0 = robot.posture(q).T_base_link, posture.T_base_link
        seen = np.array([point(robot, skin, q, s, 0.4) for s in pairs.slot])
        D = np.array([T[i] @ np.linalg.inv(T0[i]) for i in pairs.link])
        return seen - (np.einsum("ijk,ik->ij", D[:, :3, :3], pairs.on_robot) + D[:, :3, 3])

    expected = norm_of(moved, robot.n, pairs)
    found = sigmas(robot, skin, pair, joint=1.0)
    assert found == pytest.approx(expected, rel=1e-3)
    assert known_of(skin).joint[0] > FRAME_ANGLE  # the encoders' noise comes on top


def test_pairs_of_the_memory_and_empty_rows_have_no_sigma(skin, pair):
    posture, qd, pairs = pair
    slots = pairs.slot.copy()
    slots[0], slots[1] = -1, skin.slots + 3
    found = pair_sigmas(known_of(skin), replace(pairs, slot=slots), posture, qd)
    assert np.isnan(found[:2]).all() and (found[2:] > 2e-3).all()
