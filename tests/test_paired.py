"""Conditions compared seed by seed."""

import numpy as np
import pytest

from app.studies.comparisons import compared, comparison_rows
from app.studies.paired import by_seed, difference, difference_row, paired
from app.studies.trial import TrialResult


def test_seeds_that_differ_more_than_the_conditions_do_not_hide_the_difference():
    b = {seed: float(seed) for seed in range(10)}
    a = {seed: value + 0.1 + 0.001 * seed for seed, value in b.items()}
    found = paired(a, b)
    assert found.mean == pytest.approx(0.1045) and found.n == 10
    assert 0.1 < found.low < found.mean < found.high < 0.11
    assert found.p == pytest.approx(2.0**-9)  # all on one side
    other = paired(b, a)
    assert other.mean == pytest.approx(-found.mean) and other.p == found.p


def test_only_seeds_of_both_with_a_finite_figure_count():
    a, b = {1: 1.0, 2: 3.0, 3: np.inf, 4: np.nan}, {2: 1.0, 3: 1.0, 4: 1.0, 5: 9.0}
    assert paired(a, b) == (2.0, 2.0, 2.0, 1.0, 1)
    nothing = paired({1: 1.0}, {2: 1.0})
    assert nothing.n == 0 and np.isnan([nothing.mean, nothing.p]).all()


def test_no_difference_at_all_is_certainly_none():
    same = {seed: 0.3 * seed for seed in range(6)}
    assert paired(same, same) == (0.0, 0.0, 0.0, 1.0, 6)


def test_a_row_of_two_conditions_is_found_among_all_trials():
    trials = [
        TrialResult(seed, name, {"least_m": value + seed})
        for name, value in (("WB", 0.3), ("S", 0.1), ("QP", 9.0)) for seed in (0, 1)
    ]  # fmt: skip
    assert by_seed(trials, "WB", "least_m") == {0: 0.3, 1: 1.3}
    assert difference(trials, "WB", "S", "least_m").mean == pytest.approx(0.2)
    row = difference_row(trials, "WB", "S", "least_m")
    assert row["name"] == "WB - S, least_m" and row["n"] == 2


def test_what_is_compared_follows_from_the_names():
    names = ["SL", "WBL", "WBR", "QPL", "QPL-memory", "QPL+dead:3", "oracleL", "QP alone"]
    assert compared(names) == [
        ("WBL", "SL"), ("QPL", "WBL"), ("QPL-memory", "QPL"), ("QPL+dead:3", "QPL"),
        ("oracleL", "QPL"),
    ]  # fmt: skip
    assert compared(["QP-memory@a-b", "WB-memory@a-b", "QP@a-b", "QP@a"]) == [
        ("QP-memory@a-b", "WB-memory@a-b"), ("QP-memory@a-b", "QP@a-b"),
    ]  # fmt: skip


def test_a_figure_that_one_of_both_never_has_is_not_compared():
    trials = [
        TrialResult(0, name, {"least_m": 0.1, "paper_mean_m": paper})
        for name, paper in (("QP", 0.2), ("oracle", np.nan))
    ]
    rows = comparison_rows(trials, ["least_m", "paper_mean_m"])
    assert [r["name"] for r in rows] == ["oracle - QP, least_m"]
