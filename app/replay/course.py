"""How a run went, tick by tick, as its witnesses tell it; and the figures of it."""

from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.actions import SetParams
from app.config import change
from app.control.registry import kind_of
from app.errors import FlinchError
from app.messages import Array, Mode
from app.record.recording import Recording


@dataclass(frozen=True, eq=False)
class Course:
    """N ticks.

    time:     (N,) [s] from the first one.   distance: (N,) [m] smallest of the body, inf if none.
    kept:     (N,) [m] which distance the controller keeps; NaN of one that keeps none.
    qd:       (N, n) [rad/s] the commands.   activation: (N,) 0..1.
    mode:     (N,) as `Mode`.   reached: (N,) waypoints of the program.
    """

    time: Array
    distance: Array
    kept: Array
    qd: Array
    activation: Array
    mode: NDArray[np.object_]
    reached: NDArray[np.intp]


def course_of(recording: Recording) -> Course:
    """Read without computing anything anew."""
    count, params = len(recording), recording.head.params
    witnesses = [recording.witness(i) for i in range(count)]
    kept = np.empty(count)
    keeps = _kept(params)
    for i in range(count):
        for action in recording.inputs(i).actions:
            if isinstance(action, SetParams):
                try:
                    params = change(params, action.changes)
                except FlinchError:
                    continue  # it was refused then, too
                keeps = _kept(params)
        kept[i] = keeps
    times = np.asarray(recording.times)
    return Course(
        times - times[0], np.array([w.distance for w in witnesses]), kept,
        np.array([w.qd for w in witnesses]), np.array([w.activation for w in witnesses]),
        np.array([w.mode for w in witnesses], dtype=object),
        np.array([w.reached for w in witnesses], dtype=np.intp),
    )  # fmt: skip


def _kept(params: Any) -> float:
    distances = kind_of(params.mode).distances(params)
    return np.nan if distances is None else float(distances[0])


def row_of(name: str, recording: Recording, course: Course) -> dict[str, Any]:
    """The figures of a run; None where nothing can be said."""
    time, near = course.time, course.distance
    dt = np.diff(time, append=time[-1])
    near_at_all = np.isfinite(near)
    speed, jerk = np.linalg.norm(course.qd, axis=1), jerk_of(course)
    mode = recording.head.params.mode
    return {
        "name": name,
        "mode": mode,
        "scene": recording.head.scene,
        "seconds": float(time[-1]),
        "ticks": len(time),
        "dropped": recording.dropped,
        "torn": recording.torn,
        "min_distance_m": float(near.min()),
        "mean_distance_m": float(near[near_at_all].mean()) if near_at_all.any() else np.inf,
        "below_kept_s": float(dt[near < course.kept].sum()),
        "avoiding_share": float((course.activation > 0.0).mean()),
        "stops": stops(course),
        "reached": int(course.reached.max() - course.reached[0]),
        "command_mean_rad_s": float(speed.mean()),
        "command_max_rad_s": float(speed.max()),
        "jerk_rms_rad_s3": float(np.sqrt(np.mean(jerk**2))) if len(jerk) else 0.0,
    }


def stops(course: Course) -> int:
    """How often the arm was stopped."""
    return sum(a is not Mode.STOPPED and b is Mode.STOPPED for a, b in pairwise(course.mode))


def jerk_of(course: Course) -> Array:
    """(N - 2,) [rad/s^3] norm of the commands' second derivative, across equal steps of time."""
    dt = np.diff(course.time)
    if len(dt) < 2:
        return np.empty(0)
    step = float(np.median(dt))
    jerk: Array = np.linalg.norm(np.diff(course.qd, 2, axis=0), axis=1) / step**2
    return jerk


def kinds_of(recording: Recording) -> dict[str, int]:
    """How many marks of each kind there are."""
    return dict(Counter(m.kind for m in recording.marks))
