"""What a zone's range is wrong by is measured once and taken off ever after."""

from pathlib import Path

import numpy as np
import pytest

from app.checks.range_calibration import DISTANCES, simulated_walls, table_of
from app.cli import main
from app.errors import SensorError
from app.robot.ranges import (
    RangeTable,
    complete,
    load_ranges,
    save_ranges,
    wall_offset,
    with_wall,
)


def wrong(depth, bias):
    """Depths as the simulated sensors' error model reports them, noise aside."""
    return depth * (1.0 + bias) + 0.005 * np.clip(1.0 - depth / 0.2, 0.0, 1.0)


TWO_AND_NONE = np.r_[128:192, 0:64]  # slots of the third and of the first of 8x8 sensors


def table(bias):
    out = None
    first = 64 * np.arange(len(bias) + 1)
    for d in DISTANCES:
        for k in range(len(bias)):
            seen = np.tile(wrong(np.full(64, d), bias[k]), (20, 1))
            out = with_wall(out, first, k, d, wall_offset(seen, d))
    assert out is not None
    return complete(out)


def test_corrected_ranges_are_right_between_and_beyond_the_walls():
    bias = np.random.default_rng(0).normal(0.0, 0.015, (3, 64))
    known = table(bias)
    for true in (0.05, 0.13, 0.2, 0.4, 0.6, 1.5, 3.0):
        depth = wrong(np.full((2, 64), true), bias[[2, 0]]).ravel()
        found = known.corrected(TWO_AND_NONE, depth)
        assert np.abs(found - true).max() < 0.001 + 0.001 * true
        assert np.abs(depth - true).max() > 0.02 * true  # it was needed
    nearer = wrong(np.full((2, 64), 0.03), bias[[2, 0]]).ravel()
    assert np.abs(known.corrected(TWO_AND_NONE, nearer) - 0.03).max() < 0.002


def test_a_zone_that_saw_no_wall_is_left_as_it_is():
    bad = np.full((20, 64), 0.31)
    bad[:, 5] = np.nan
    known = complete(with_wall(None, np.array([0, 64, 128]), 1, 0.3, wall_offset(bad, 0.3)))
    depth = np.full(128, 0.31)
    found = known.corrected(np.arange(128), depth)
    assert np.array_equal(found[:64], depth[:64]) and found[64 + 5] == 0.31
    assert found[64 + 6] == pytest.approx(0.3, abs=1e-3)


def test_walls_may_come_in_any_order():
    only = np.array([0, 64])
    far = with_wall(None, only, 0, 0.6, np.full(64, 0.01))
    one = with_wall(far, only, 0, 0.2, np.full(64, 0.002))
    assert one.at.tolist() == [0.2, 0.6] and one.offset[0].tolist() == [0.002, 0.01]
    again = with_wall(one, only, 0, 0.2, np.full(64, 0.003))
    assert again.at.tolist() == [0.2, 0.6] and again.offset[0, 0] == 0.003


def test_a_table_survives_its_file(tmp_path):
    file = tmp_path / "ranges.txt"
    known = RangeTable(np.array([0.1, 0.5]), np.random.default_rng(1).normal(size=(128, 2)) / 100)
    known.offset[3, 1] = np.nan
    save_ranges(file, known)
    back = load_ranges(file, 128)
    assert np.allclose(back.at, known.at)
    assert np.allclose(back.offset, known.offset, atol=1e-5, equal_nan=True)
    with pytest.raises(SensorError, match="this skin has 192"):
        load_ranges(file, 192)
    file.write_text("not a table")
    with pytest.raises(SensorError, match="calibrate ranges"):
        load_ranges(file, 128)


def test_simulated_walls_find_the_bias_of_the_simulated_zones(robot, skin):
    walls = [w for w in simulated_walls(robot, skin, 3) if w[0] == 7]
    known = complete(table_of(walls, skin.first))
    for _, distance, depth in walls:
        free = np.isfinite(wall_offset(depth, distance))  # the arm is in the way of some
        assert free.sum() > 50
        middle = np.nanmedian(depth, axis=0)
        found = known.corrected(np.arange(64 * 7, 64 * 8), middle)[free]
        assert np.nanmax(np.abs(found - distance)) < 1e-5 + 0.01 * distance
        assert np.nanstd(found) < 0.2 * np.nanstd(middle[free])


def test_a_recorded_wall_needs_its_distance(tmp_path: Path, capsys):
    assert main(["calibrate", "ranges", "somewhere.csv", str(tmp_path / "r.txt")]) == 1
    assert "--distance" in capsys.readouterr().err
