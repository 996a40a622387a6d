"""How old a pair's distance is, and how well it is known where no sensor sees its point."""

import numpy as np
import pytest

from app.messages import Cloud, JointState, Pairs
from app.perception.pair_doubt import REMEMBERED, with_doubt
from app.perception.uncertainty import known_of, pair_sigmas

K, ZONE = 15, 9
SLOT = K * 64 + ZONE


def test_a_remembered_point_has_its_own_doubt_and_age_and_no_point_knows_nothing(robot, skin):
    posture, still = robot.posture(robot.home), np.zeros(6)
    T = posture.T_base_link[skin.link[K]]
    p = T[:3, :3] @ (skin.origin[K] + 0.3 * skin.reach[SLOT]) + T[:3, 3]
    n = np.tile([1.0, 0.0, 0.0], (3, 1))
    slot = np.array([SLOT, skin.slots, -1])
    pairs = Pairs(np.full(3, 4), np.full(3, 0.3), p + 0.3 * n, p + 0.0 * n, n, slot, 0)
    cloud, joints = (
        Cloud(*np.empty((5, 0)), np.full(skin.count, 1.0)),
        JointState(1.05, None, still),
    )
    found = with_doubt(pairs, cloud, np.array([0.4]), posture, joints, known_of(skin))
    assert found.age == pytest.approx([0.05, 0.65, np.inf])
    seen = pair_sigmas(known_of(skin), pairs, posture, still)[0]
    assert found.sigma == pytest.approx([seen, REMEMBERED, np.inf]) and 0.002 < seen < 0.02
