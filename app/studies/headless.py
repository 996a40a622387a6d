"""The same engine without a page and without waiting: a run and what came of it."""

from collections.abc import Callable

from app.config import Params
from app.control.goals import goal_error
from app.judge.run import Judge, Record
from app.messages import Snapshot
from app.report import Check, Report
from app.runtime import Engine
from app.setup import Setup
from app.sources import clock_for
from app.wiring import build_engine

Ready = Callable[[Engine], None]


def nothing(engine: Engine) -> None:
    """An engine needs nothing more to be ready."""


def step_until(engine: Engine, end: float, *watchers: Callable[[Snapshot], None]) -> Snapshot:
    """Step to `end` [s] on its clock, or until a recording has ended; returns the last tick's.

    Every watcher is handed every snapshot. The engine is closed then, whatever happens.
    """
    ticks = engine.subscribe(1)
    try:
        while True:
            snapshot = engine.step()
            for watch in watchers:
                watch(snapshot)
            ((inputs, _),) = ticks.take()
            if snapshot.stamp >= end or inputs.source.ended:
                return snapshot
    finally:
        engine.close()


def run(
    setup: Setup, seconds: float, params: Params | None = None, ready: Ready = nothing
) -> tuple[Record, Snapshot]:
    """Run for `seconds` of simulated time, or until the recording has ended.

    ready: is given the engine before its first tick.
    """
    clock = clock_for(setup)
    engine = build_engine(setup, clock, params)
    try:
        ready(engine)
    except BaseException:
        engine.close()
        raise
    judge = Judge(engine)
    judge.record.began, judge.record.warnings = clock.now(), engine.warnings
    last = step_until(engine, judge.record.began + seconds, judge.update)
    return judge.record, last


def summary(
    setup: Setup, seconds: float, params: Params | None = None, ready: Ready = nothing
) -> Report:
    """A run as a report: smallest true and perceived distance, goal error, stops."""
    record, last = run(setup, seconds, params, ready)
    position, angle = goal_error(last.T_base_tool, last.goal.T_base_tool)
    row = {
        "name": "run",
        "scene": setup.scene,
        "sensors": setup.sensors,
        "mode": last.params.mode,
        "seconds": last.stamp - record.began,
        "ticks": last.tick + 1,
        "min_true_distance_m": min(record.true_distance),
        "min_perceived_distance_m": min(record.seen_distance),
        "goal_error_m": position,
        "goal_error_rad": angle,
        "lowest_point_m": record.lowest,
        "avoiding_share": record.avoiding / record.ticks,
        "blind_share": record.blind / record.ticks,
        "status": last.status.mode.value,
        "reasons": dict(record.reasons),
        "advice": dict(record.advice),
        "stops": record.stops,
        "warnings": list(record.warnings),
    }
    checks = [
        Check("excess over a joint velocity limit", record.overspeed, "rad/s", 0.0),
        Check("excess over a joint position limit", record.overreach, "rad", 0.0),
    ]
    return Report("run", setup.seed, [row], checks)
