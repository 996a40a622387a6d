"""How well a pair's distance is known: as drawn errors of the sensor say, and none in `paper`."""

from dataclasses import replace

import numpy as np
import pytest

from app.messages import Cloud, JointState, Pairs
from app.perception.pair_doubt import REMEMBERED, who_of, with_doubt
from app.robot.posture import rotation_matrix

K, ZONE = 15, 9
SLOT = K * 64 + ZONE


def pair_at(skin, robot, q, distance, direction):
    """The pair of a zone that sees something at `distance`, with a normal of this direction."""
    T = robot.posture(q).T_base_link[skin.link[K]]
    p = T[:3, :3] @ (skin.origin[K] + distance * skin.reach[SLOT]) + T[:3, 3]
    n = np.array(direction) / np.linalg.norm(direction)
    return Pairs(
        np.array([4]), np.array([0.3]), (p + 0.3 * n)[None], p[None], n[None], np.array([SLOT]), 0
    )  # fmt: skip


def doubt_of(skin, robot, q, qd, pairs):
    stamp = np.full(skin.count, 1.0)
    cloud = Cloud(*np.empty((5, 0)), stamp)
    return with_doubt(
        pairs, cloud, np.array([0.4]), robot.posture(q), JointState(1.05, q, qd), who_of(skin)
    )  # fmt: skip


@pytest.mark.parametrize("distance", [0.1, 0.3, 1.2])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0.3, -1, 0.4), (0, 0.2, 1)])
def test_sigma_is_the_spread_of_points_that_erring_sensors_report(robot, skin, distance, direction):
    rng, q = np.random.default_rng(3), robot.home
    qd = np.array([0.6, -0.4, 0.5, 0.3, 0.2, 0.1])
    pairs, d = pair_at(skin, robot, q, distance, direction), skin.doubt
    late, ray = 0.02, distance * skin.reach[SLOT]
    skin = replace(skin, doubt=replace(d, time=np.full(skin.count, late)))
    along, spread = np.linalg.norm(ray), []
    for _ in range(1500):
        t, link = rng.normal(scale=late), skin.link[K]
        T = robot.posture(q + qd * t).T_base_link[link]
        noise = rng.normal(scale=max(0.0007, 0.0065 * along)) / along
        r = ray * (1.0 + noise + rng.normal(scale=d.share[K]))
        turn = rotation_matrix(rng.normal(scale=d.angle[K], size=3))
        origin = skin.origin[K] + rng.normal(scale=d.position[K], size=3)
        spread.append((T[:3, :3] @ (origin + turn @ r) + T[:3, 3]) @ pairs.normal[0])
    sigma = doubt_of(skin, robot, q, qd, pairs).sigma[0]
    assert sigma == pytest.approx(np.std(spread), rel=0.08)


def test_a_remembered_point_has_its_own_doubt_and_age_and_no_point_knows_nothing(robot, skin):
    q = robot.home
    pairs = pair_at(skin, robot, q, 0.3, (1, 0, 0))
    for slot, sigma, age in ((SLOT, None, 0.05), (skin.slots, REMEMBERED, 0.65)):
        found = doubt_of(skin, robot, q, np.zeros(6), replace(pairs, slot=np.array([slot])))
        assert found.age[0] == pytest.approx(age)
        assert sigma is None or found.sigma[0] == sigma
    none = doubt_of(skin, robot, q, np.zeros(6), replace(pairs, slot=np.array([-1])))
    assert np.isinf(none.sigma[0]) and np.isinf(none.age[0])
