"""Which candidates to take for a budget: greedily, then by exchange, with a bound on the best.

The worth of a set is  F(S) = sum_i w_i max_{s in S} U[s, i],  monotone and submodular. Taken are
the candidates with the largest gain, or with the largest gain a unit of cost, whichever comes out
better (Leskovec et al. 2007); then one at a time is exchanged for a better one, until none is.

Whatever was chosen, the best set O is worth no more than  F(S) + sum of the gains that its members
still have, which is at most what the budget buys of the largest gains by cost (a fractional
knapsack): a bound that needs no assumption on how S came about (Leskovec et al. 2007).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

BETTER = 1e-4  # by which an exchange must gain, where one step of every way is 1


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """What is chosen from.

    worth: (R, n) of each of R candidates in each of n ways.   weight: (n,), not negative.
    cost:  (R,) whole numbers.   clash: (R, R) bool, symmetric: never both; the diagonal is True.
    """

    worth: NDArray[np.uint8]
    weight: NDArray[np.float32]
    cost: NDArray[np.int64]
    clash: NDArray[np.bool_]


class Choice(NamedTuple):
    """Candidates taken, in the order in which they were, what they are worth, and a bound of what
    any choice within the budget is."""

    taken: tuple[int, ...]
    value: float
    bound: float


def choose(p: Problem, budget: int) -> Choice:
    """The best that is found for a budget."""
    options = [_exchanged(p, _greedy(p, [], budget, by_cost), budget)
               for by_cost in (True, False)]  # fmt: skip
    taken = max(options, key=lambda s: value(p, s))
    return Choice(tuple(taken), value(p, taken), bound(p, taken, budget))


def value(p: Problem, taken: list[int]) -> float:
    """F of a set."""
    return float(_best(p, taken).astype(np.float64) @ p.weight)


def bound(p: Problem, taken: list[int], budget: int) -> float:
    """No set within the budget is worth more, whatever clashes."""
    gain = _gains(p.worth, p.weight, _best(p, taken))
    left, most = budget, value(p, taken)
    for r in np.argsort(-gain / p.cost, kind="stable"):
        share = min(1.0, left / int(p.cost[r]))
        most += share * float(gain[r])
        left -= int(p.cost[r])
        if left <= 0:
            break
    return most


def _greedy(p: Problem, taken: list[int], budget: int, by_cost: bool) -> list[int]:
    """Goes on from what is taken until nothing fits or gains anything."""
    taken, left = list(taken), budget - int(p.cost[taken].sum())
    while True:
        gain = _gains(p.worth, p.weight, _best(p, taken))
        free = (p.cost <= left) & ~p.clash[taken].any(axis=0)
        score = np.where(free, gain / p.cost if by_cost else gain, 0.0)
        best = int(score.argmax())
        if score[best] <= 0.0:
            return taken
        taken.append(best)
        left -= int(p.cost[best])


def _exchanged(p: Problem, taken: list[int], budget: int) -> list[int]:
    """Each in turn makes room for the best in its place, while that gains."""
    least, done = BETTER * float(p.weight.sum()), False
    while not done:
        done = True
        for out in list(taken):
            rest = [s for s in taken if s != out]
            found = _greedy(p, rest, budget, False)
            if value(p, found) > value(p, taken) + least:
                taken, done = found, False
                break
    return taken


def _best(p: Problem, taken: list[int]) -> NDArray[np.uint8]:
    return np.asarray(p.worth[taken].max(axis=0, initial=0), dtype=np.uint8)


@compiled
def _gains(worth: NDArray[np.uint8], weight: NDArray[np.float32], best: NDArray[np.uint8]) -> Array:
    """(R,) what each candidate adds to what is seen best already."""
    out = np.zeros(len(worth))
    for r in range(len(worth)):
        total = 0.0
        for i in range(worth.shape[1]):
            if worth[r, i] > best[i]:
                total += weight[i] * (worth[r, i] - best[i])
        out[r] = total
    return out
