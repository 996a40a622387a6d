"""The rays that stand for a zone: where they lie, and how many."""

import numpy as np
import pytest

from app.perception.footprint import fan_of, pattern
from app.robot.skin import zone_directions


@pytest.mark.parametrize(("footprint", "first", "both"), [(1, 1, 1), (3, 9, 25), (5, 25, 81)])
def test_a_first_look_is_a_grid_from_rim_to_rim_and_a_second_fills_it(footprint, first, both):
    offsets = pattern(footprint)
    assert len(offsets) == both and (offsets[0] == 0.0).all()
    assert len(np.unique(offsets, axis=0)) == both
    if footprint > 1:
        assert np.abs(offsets[1:first]).max(axis=0).tolist() == [1.0, 1.0]
        steps = np.unique(offsets[:first])
        assert np.diff(steps) == pytest.approx(2.0 / (footprint - 1))


def test_a_spread_of_one_reaches_the_rims_of_a_zone(skin):
    fan, k = fan_of(skin), 4
    R = skin.sensors[k].T_link_sensor[:3, :3]
    for zone in (0, 27, 63):
        slot = skin.first[k] + zone
        corner = fan.centre[slot] + fan.across[slot] + fan.down[slot]
        row, column = np.array([zone // 8 + 0.5]), np.array([zone % 8 + 0.5])
        assert corner == pytest.approx(
            R @ zone_directions(skin.sensors[k], row, column)[0], abs=2e-3
        )
