"""How near a zone can report a body that only some of its rays meet."""

import numpy as np
import pytest

from app.messages import Verdict
from app.perception.footprint import pattern
from app.perception.mixing import BRIGHTER, least_report
from app.perception.rules import Rules
from app.perception.self_filter import SelfFilter

OFFSET = pattern(3)
CORNER = np.flatnonzero((OFFSET == 1.0).all(axis=1))
MERGE, NEVER = 0.6, -1.0


def least(near, d=0.4, far=0.5, wide=1.0):
    """What a zone may report at least whose rays `near` end at d, the others at `far`."""
    distance = np.full(len(OFFSET), far, dtype=np.float32)
    distance[near] = d
    return least_report(distance, OFFSET, wide, MERGE, NEVER)


def test_a_body_that_fills_the_zone_is_reported_where_it_is():
    assert least(np.arange(25)) == pytest.approx(0.4)
    assert least([], far=0.7) == pytest.approx(0.7)
    assert least([], far=np.inf) == np.inf


def test_the_body_alone_is_reported_however_little_of_the_zone_it_fills():
    assert least(CORNER, far=np.inf) == pytest.approx(0.4)
    assert least(CORNER, far=0.4 + 1.01 * MERGE) == pytest.approx(0.4)  # told apart from the rest


def test_a_corner_of_a_zone_draws_its_report_by_no_more_than_its_light():
    near = BRIGHTER / 64.0 / 0.4**2  # it stands for a sixty-fourth of the zone
    rest = (1.0 - 0.1 / MERGE) ** 3 * 63.0 / 64.0 / 0.5**2
    assert least(CORNER) == pytest.approx(0.5 - 0.1 * near / (near + rest))


def test_a_report_is_drawn_the_more_the_farther_the_zone_may_look_aside():
    rim = np.flatnonzero(OFFSET[:, 0] == 1.0)
    found = [least(rim, wide=wide) for wide in (1.0, 1.1, 1.5, 2.0)]
    assert found == sorted(found, reverse=True) and found[0] > 0.45 > found[-1]


def test_what_may_be_reported_so_near_is_not_looked_at_further():
    every = least(np.arange(12))
    distance = np.full(len(OFFSET), 0.5, dtype=np.float32)
    distance[:12] = 0.4
    assert least_report(distance, OFFSET, 1.0, MERGE, every + 0.001) <= every + 0.001
    assert least_report(distance, OFFSET, 1.0, MERGE, every - 0.001) == pytest.approx(every)


def test_an_obstacle_before_a_part_of_the_arm_is_kept_beside_a_nearer_part_of_it(robot, skin):
    """Zones that the body slants through: an obstacle 5 cm before where they would report it is not
    explained by the little of it that is as near."""
    judge, everyone, kept, own = SelfFilter(robot, skin), np.arange(skin.count), [], []
    rng = np.random.default_rng(3)
    for _ in range(12):
        posture = robot.posture(robot.home + rng.uniform(-1.0, 1.0, robot.n))
        far = judge.judge(everyone, np.full(skin.slots, 9.0), posture, Rules(footprint=False))
        body = 9.0 + far.gap
        mine = np.flatnonzero((body > 0.15) & (body < 1.0))
        reports = np.full(skin.slots, 9.0)
        for before, found in ((0.0, own), (0.05, kept)):
            reports[mine] = body[mine] - before
            judged = judge.judge(everyone, reports, posture, Rules())
            found.append(judged.verdict[mine] == Verdict.KEPT)
    assert not np.concatenate(own).any()
    assert np.concatenate(kept).mean() > 0.88
