"""How long the reflex takes (`app.reflex`): whole steps on frames that were measured before."""

import time
from types import SimpleNamespace

import numpy as np

from app.reflex import Guard, Twist
from app.report import Check, Report
from app.setup import Setup
from app.tick import Inputs, Tick
from app.timing import ManualClock
from app.wiring import build_engine

STEP_LIMIT = 0.8  # [ms] median of a step with 30 sensors
WARM = 200  # steps before anything is timed
WANTED = np.array([0.05, 0.0, 0.0, 0.0, 0.0, 0.0])  # [m/s] of the tool


def bench_guard(setup: Setup, seconds: float = 5.0) -> Report:
    """Steps of a guard that is given what an arm in this scene has met, at this rate."""
    engine = build_engine(setup, ManualClock())
    inputs: list[Inputs] = []

    def note(tick: Tick) -> None:
        inputs.append(tick[0])

    engine.follow(SimpleNamespace(put=note, close=inputs.copy))
    for _ in range(WARM + int(seconds * setup.rate)):
        engine.step()
    guard, wanted, wall, own = Guard(engine.robot, engine.skin, engine.cell), Twist(WANTED), [], []
    engine.close()
    for x in inputs:
        begin, used = time.perf_counter(), time.thread_time()
        guard.step(x.frames, x.joints, wanted)
        wall.append(time.perf_counter() - begin)
        own.append(time.thread_time() - used)
    rows = [_row("step", wall), _row("step, processor's time", own)]
    median = 1e3 * float(np.median(wall[WARM:]))
    sensors = engine.skin.count
    checks = [Check(f"step with {sensors} sensors, median", median, "ms", STEP_LIMIT)]
    return Report("bench guard", setup.seed, rows, checks)


def _row(name: str, seconds: list[float]) -> dict[str, object]:
    p50, p95, p99 = 1e3 * np.percentile(seconds[WARM:], [50, 95, 99])
    return {"name": name, "p50_ms": float(p50), "p95_ms": float(p95), "p99_ms": float(p99)}
