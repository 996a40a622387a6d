"""The exact solver: the minimum each time, also where another solver called a wrong end solved."""

import json
from pathlib import Path

import numpy as np
import pytest

from app.control import qp
from app.control.active_set import minimise
from app.control.qp import Costs, second_opinion, solve
from app.control.rows import Rows

CAPTURED = json.loads((Path(__file__).parent / "captured_problems.json").read_text())


def problem(rng):
    """As the controller's: six weighted rows of a goal, dear slack, a box of any width."""
    n, m = 7, int(rng.integers(0, 33))
    A = rng.normal(size=(6, n))
    H = 10.0 * A.T @ A + 3e-3 * np.eye(n)
    g = rng.normal(size=n) * rng.choice([1e-3, 1.0, 10.0])
    J = rng.normal(scale=0.4, size=(m, n))
    if m > 4 and rng.random() < 0.3:
        J[1], J[2] = J[0], -J[0]  # the same wall twice, and one opposite to it
    b, c = rng.uniform(-0.8, 0.3, m), rng.choice([50.0, 100.0, 500.0], m)
    if m > 6 and rng.random() < 0.3:
        J[3:6], b[3:6], c[3:6] = J[0], b[0], c[0]  # one bound four times
    middle, half = rng.uniform(-0.3, 0.3, n), rng.choice([0.0, 0.024, 0.3, 3.0])
    return H, g, J, b, c, np.full(m, 100.0), middle - half, middle + half


def cost(x, H, g, J, b, c, w):
    s = np.maximum(b - J @ x, 0.0)
    return 0.5 * x @ H @ x + g @ x + (c * s + 0.5 * w * s * s).sum()


def test_ten_thousand_new_problems_are_all_solved_within_their_boxes():
    rng = np.random.default_rng(11)
    unsolved, outside = 0, 0.0
    for _ in range(10_000):
        H, g, J, b, c, w, low, high = problem(rng)
        x = np.empty(len(g))
        unsolved += minimise(H, g, J, b, c, w, low, high, x) < 0
        outside = max(outside, float((x - high).max()), float((low - x).max()))
    assert unsolved == 0 and outside <= 1e-9


def test_no_step_in_any_direction_is_cheaper():
    rng = np.random.default_rng(12)
    for k in range(500):
        H, g, J, b, c, w, low, high = problem(rng)
        x = np.empty(len(g))
        minimise(H, g, J, b, c, w, low, high, x)
        best = cost(x, H, g, J, b, c, w)
        for size in (1e-4, 1e-2):
            for step in rng.normal(size=(20, len(g))):
                y = np.clip(x + size * step, low, high)
                assert best <= cost(y, H, g, J, b, c, w) + 1e-9 * max(1.0, abs(best)), k


def test_it_is_exact_where_the_answer_is_known():
    H, x = np.diag([2.0, 4.0]), np.empty(2)
    wide = np.full(2, 50.0)

    def at(g, J, b, c, w, low=-wide, high=wide):
        J = np.asarray(J, float).reshape(-1, 2)
        many = (np.asarray(v, float) for v in (b, c, w))
        assert minimise(H, np.asarray(g, float), J, *many, low, high, x) >= 0
        return x.tolist()

    assert at([-2, -4], [], [], [], []) == pytest.approx([1, 1])
    assert at([-2, -4], [], [], [], [], high=np.array([0.5, 50])) == pytest.approx([0.5, 1])
    assert at([0, 0], [[1, 0]], [3], [100], [1]) == pytest.approx([3, 0])  # the price holds
    assert at([0, 0], [[1, 0]], [3], [1], [1]) == pytest.approx([4 / 3, 0])  # it gives way
    assert at([0, 0], [[1, 0], [-1, 0]], [1, 1], [50, 50], [100, 100]) == pytest.approx([0, 0])


@pytest.mark.parametrize("captured", CAPTURED)
def test_a_slow_arm_near_its_goal_is_solved(captured):
    """Problems that stopped the arm: every cost is small, and a joint must keep on braking."""
    low, high = np.array(captured.pop("low")), np.array(captured.pop("high"))
    arrays = {k: np.array(v) if isinstance(v, list) else v for k, v in captured.items()}
    none = np.empty(0)
    rows = Rows(np.empty((0, 6)), *[none] * 6)
    answer = solve(Costs(**arrays), rows, low, high)
    assert answer is not None and (answer.qd >= low).all() and (answer.qd <= high).all()
    captured.update(low=low, high=high)

    def cost_of(qd, beta):
        c = Costs(**arrays)
        W, t = qp.TASK_WEIGHT, c.twist
        miss = c.tool @ qd - beta * t
        away = c.k_b * (W @ (t * t) + 1e-4) * (1.0 - beta) ** 2
        effort = c.lambda_q * qd @ qd + c.lambda_a * (qd - c.previous) @ (qd - c.previous)
        return 0.5 * (c.k_g * miss @ (W * miss) + away + effort) - c.push @ qd

    best, rng = cost_of(answer.qd, answer.progress), np.random.default_rng(0)
    for size in (1e-3, 1.0):
        for step in rng.normal(size=(200, 7)) * size:
            qd = np.clip(answer.qd + 0.1 * step[:6], low, high)
            assert best <= cost_of(qd, np.clip(answer.progress + step[6], 0.0, 1.0)) + 1e-9


def test_the_second_opinion_agrees_and_stands_in_when_the_steps_run_out(monkeypatch):
    rng = np.random.default_rng(13)
    agreed = 0
    for _ in range(60):
        H, g, J, b, c, w, low, high = problem(rng)
        x = np.empty(len(g))
        minimise(H, g, J, b, c, w, low, high, x)
        rows = Rows(J, b, c, w, *np.zeros((3, len(b))))
        second = second_opinion(H, g, J, rows, low, high)
        if second is not None:
            agreed += 1
            assert cost(second, H, g, J, b, c, w) == pytest.approx(
                cost(x, H, g, J, b, c, w), rel=1e-3, abs=1e-3
            )
    assert agreed > 30
    monkeypatch.setattr(qp, "minimise", lambda *_: -1)
    n = 6
    costs = Costs(np.eye(6), np.full(6, 0.1), np.zeros(n), np.zeros(n), 10.0, 0.5, 1e-3, 2e-3, True)
    rows = Rows(np.eye(1, 6), np.array([0.3]), *np.full((2, 1), 50.0), *np.zeros((3, 1)))
    answer = solve(costs, rows, -np.ones(n), np.ones(n))
    assert answer is not None and answer.qd[0] == pytest.approx(0.3, abs=1e-4)


def test_what_is_not_a_number_is_no_answer():
    n = 6
    costs = Costs(np.eye(6), np.full(6, np.nan), *[np.zeros(n)] * 2, 10.0, 0.5, 1e-3, 2e-3, True)
    none = np.empty(0)
    assert solve(costs, Rows(np.empty((0, 6)), *[none] * 6), -np.ones(n), np.ones(n)) is None
