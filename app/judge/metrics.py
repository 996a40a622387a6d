"""Figures of runs beside people, each with its formula. k counts the trials of a condition.

The paper's two are `mean_minimum` and `largest_deviation` of the distance d_paper between two
clouds (`app.judge.clouds`); all others are of the truth. A distance is in metres, over times that
are evenly apart; +inf where nothing is near.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.messages import Array

KNOWN = 0.10  # [m] a perceived point so near to a true one is taken for it
NEAR = 1.0  # [m] what is farther away need not be seen
JUMP = 0.05  # [m] in one tick: another control point, not the same one sliding on
CALM = 0.5  # [s] nobody was near for so long before an approach
ACTS = 0.05  # activation
HELD_BACK = 0.99  # of what was asked for: with less of it left a command was held back
REACTS = 0.05  # [m/s] by which the arm's own point must be led away more than before


def mean_minimum(trials: Sequence[Array]) -> float:
    """dbar = 1/K sum_k mean_t d_k(t) [m], over the times at which there is a distance."""
    return float(np.mean([np.mean(_finite(d)) for d in trials]))


def largest_deviation(trials: Sequence[Array]) -> float:
    """sigma_max = max_k std_t d_k(t) [m], over the times at which there is a distance."""
    return float(np.max([np.std(_finite(d)) for d in trials]))


def share_below(d: Array, limit: float) -> float:
    """mean_t [d(t) < limit]: share of the time below the distance to be kept."""
    return float(np.mean(d < limit))


def shortfall(d: Array, limit: float) -> float:
    """mean_t max(0, limit - d(t)) [m]: by how much the distance to be kept is missed."""
    return float(np.mean(np.maximum(limit - d, 0.0)))


def contacts(d: Array) -> int:
    """How often d(t) <= 0 begins."""
    touching = np.concatenate([[False], d <= 0.0])
    return int(np.count_nonzero(touching[1:] & ~touching[:-1]))


def effort(qd: Array, rate: float) -> float:
    """integral |qd|^2 dt = sum_t |qd(t)|^2 / rate [rad^2/s] of commands (T, n): what a motion
    costs in drives of equal damping."""
    return float(np.sum(np.square(qd)) / rate)


def path_error(tool: Array, goal: Array) -> float:
    """sqrt(mean_t |p_tool(t) - p_goal(t)|^2) [m] of (T, 3) each; the goal is that of the tick,
    on the straight line between two waypoints."""
    return float(np.sqrt(np.mean(np.sum(np.square(tool - goal), axis=1))))


def jerk_rms(qd: Array, rate: float) -> float:
    """sqrt(mean_t,i (qd[t+1] - 2 qd[t] + qd[t-1])^2) rate^2 [rad/s^3] of commands (T, n)."""
    return float(np.sqrt(np.mean(np.square(np.diff(qd, n=2, axis=0) * rate * rate))))


def jumps_per_second(jump: Array, seconds: float) -> float:
    """#[jump(t) > JUMP] / seconds: how often the control point is another one at once; `jump`
    [m] is its way since the last tick."""
    return float(np.count_nonzero(jump > JUMP) / seconds)


def reaction_times(stamp: Array, d: Array, activation: Array, begins: float) -> list[float]:
    """[s] from d(t) falling below `begins`, after `CALM` without, to activation > `ACTS`.

    One of each approach at which the avoidance did not act already; an approach that ends without
    a reaction counts as long as it lasted.
    """
    near = d < begins
    out = []
    for i in (np.flatnonzero(near[1:] & ~near[:-1]) + 1).tolist():
        before = near[(stamp >= stamp[i] - CALM) & (stamp < stamp[i])]
        if before.any() or activation[i - 1] > ACTS:
            continue
        ends = i + int(np.argmin(np.append(near[i:], False)))
        acts = np.flatnonzero(activation[i:ends] > ACTS)
        last = i + int(acts[0]) if len(acts) else min(ends, len(stamp) - 1)
        out.append(float(stamp[last] - stamp[i]))
    return out


def own_reaction_times(stamp: Array, d: Array, led: Array, begins: float) -> list[float]:
    """[s] from d(t) falling below `begins`, after `CALM` without, to led(t) > led(then) + `REACTS`.

    Asked of the arm's motion alone, so in the same way of every controller. led: [m/s] at which
    the arm itself leads its nearest link away (`app.judge.contact.led_away`). Left out where it
    did so already; an approach that ends without a reaction counts as long as it lasted.
    """
    near = d < begins
    out = []
    for i in (np.flatnonzero(near[1:] & ~near[:-1]) + 1).tolist():
        if near[(stamp >= stamp[i] - CALM) & (stamp < stamp[i])].any() or led[i] > REACTS:
            continue
        ends = i + int(np.argmin(np.append(near[i:], False)))
        acts = np.flatnonzero(led[i:ends] > led[i] + REACTS)
        last = i + int(acts[0]) if len(acts) else min(ends, len(stamp) - 1)
        out.append(float(stamp[last] - stamp[i]))
    return out


def seen_share(d: Array, away: Array) -> float:
    """mean_t [away(t) < KNOWN] over times with d(t) < NEAR; NaN without any.

    away: [m] from the world's point that is truly nearest to the nearest perceived one.
    """
    near = d < NEAR
    return float(np.mean(away[near] < KNOWN)) if near.any() else np.nan


def _finite(d: Array) -> Array:
    kept: Array = d[np.isfinite(d)]
    return kept if len(kept) else np.array([np.nan])


def least_and_low(d: Array) -> tuple[float, float]:
    """min_t d(t) and its 5th percentile [m]."""
    return float(d.min()), float(np.quantile(d, 0.05, method="lower"))


def shares(values: Sequence[str]) -> dict[str, float]:
    """Share of each value, the most frequent first."""
    names: NDArray[np.str_]
    names, count = np.unique(np.array(values, dtype=str), return_counts=True)
    order = np.argsort(-count, kind="stable")
    return {str(names[i]): float(count[i] / count.sum()) for i in order}
