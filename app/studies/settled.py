"""What a run came to before something that stands still."""

from typing import Any

import numpy as np

from app.judge.encounter import Notes

LAST = 2.0  # [s] of a run, in which it should have settled


def settled(notes: Notes) -> dict[str, Any]:
    """Distance and goal at the end of a run, and how much its activation went to and fro.

    steady_m, steady_std_m: mean and deviation of the true distance over the last `LAST` seconds.
    goal_error_m, goal_std_m: the same of |p_tool - p_goal|.
    chatter_per_s: sum |a[t+1] - a[t]| / T of the activation, of the times judged, over the run.
    """
    stamp, true = np.array(notes.stamp), np.array(notes.true)
    last = stamp > stamp[-1] - LAST
    away = np.linalg.norm(np.array(notes.tool) - np.array(notes.goal), axis=1)
    end = away[-max(1, round(len(away) * LAST / max(stamp[-1], LAST))) :]
    return {
        "steady_m": float(true[last].mean()),
        "steady_std_m": float(true[last].std()),
        "goal_error_m": float(end.mean()),
        "goal_std_m": float(end.std()),
        "chatter_per_s": float(np.abs(np.diff(notes.activation)).sum() / max(stamp[-1], 1e-9)),
    }
