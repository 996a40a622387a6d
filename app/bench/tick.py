"""Where each millisecond of a tick goes, and how late ticks begin.

Medians are the figures to compare: the machine may be shared. Lateness is given beside an
empty loop's in the same run, since on a noisy machine most of it is not ours.
"""

import gc
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from app.bench.perception import frames_of
from app.perception.cloud import SkinCloud
from app.perception.proximity import BodyPairs
from app.perception.rules import Rules
from app.report import Check, Report
from app.runtime import Engine
from app.setup import Setup
from app.timing import ManualClock, Ticker, WallClock
from app.wiring import build_engine

TICK_LIMIT = 2.0  # [ms] median of a whole tick with 30 sensors
SET_LIMIT = 4.0  # [ms] 1920 zones through self filter and closest pairs
OUTSIDE = ("simulate",)  # laps that are the simulated world's, not the tick's
WARM = 200  # ticks before anything is timed


def bench_tick(setup: Setup, seconds: float = 5.0) -> Report:
    """Measure rooms, whole ticks, a whole set of zones, and lateness."""
    clock = ManualClock()
    engine = build_engine(setup, clock)
    rooms: dict[str, list[float]] = {}
    whole: list[float] = []
    ticks = int(seconds * setup.rate)
    for i in range(WARM + ticks):
        laps = engine.step().timing.rooms
        if i >= WARM:
            for name, t in laps.items():
                rooms.setdefault(name, []).append(t)
            whole.append(sum(t for name, t in laps.items() if name not in OUTSIDE))
    rows = [_row(name, t) for name, t in rooms.items()]
    rows.append(_row("tick", whole))
    full = _full_set(engine)
    rows.append(_row("whole set of zones", full))
    late, missed = _lateness(setup, seconds)
    empty, empty_missed = _empty_lateness(setup.rate, seconds)
    rows.append(_row("lateness", late) | {"missed": missed})
    rows.append(_row("lateness, empty loop", empty) | {"missed": empty_missed})
    checks = [
        Check("tick, median", 1e3 * float(np.median(whole)), "ms", TICK_LIMIT),
        Check("whole set of zones, median", 1e3 * float(np.median(full)), "ms", SET_LIMIT),
    ]
    return Report("bench tick", setup.seed, rows, checks)


def _full_set(engine: Engine, repeats: int = 200) -> list[float]:
    """Every sensor's frame at one posture through self filter and closest pairs."""
    robot, skin, rules = engine.robot, engine.skin, Rules()
    posture = robot.posture(robot.home)
    cloud, body = SkinCloud(robot, skin, engine.cell), BodyPairs(robot)
    rng = np.random.default_rng(0)
    times = []
    for i in range(repeats):
        frames = frames_of(skin, rng.uniform(0.1, 2.0, skin.slots), i / 15.0)
        begin = time.perf_counter()
        cloud.add_frames(frames, posture, rules)
        body.update(cloud.view(i / 15.0), posture)
        times.append(time.perf_counter() - begin)
    return times[10:]


def _lateness(setup: Setup, seconds: float) -> tuple[list[float], int]:
    engine = build_engine(setup, WallClock())
    return _paced(engine.ticker, engine.step, int(seconds * setup.rate))


def _empty_lateness(rate: float, seconds: float) -> tuple[list[float], int]:
    ticker = Ticker(WallClock(), 1.0 / rate)
    return _paced(ticker, ticker.wait, int(seconds * rate))


def _paced(ticker: Ticker, step: Callable[[], Any], ticks: int) -> tuple[list[float], int]:
    gc.collect()
    for _ in range(WARM // 4 + ticks):
        step()
    return list(ticker.lateness)[-ticks:], ticker.missed


def _row(name: str, seconds: list[float]) -> dict[str, Any]:
    p50, p95, p99 = 1e3 * np.percentile(seconds, [50, 95, 99])
    return {"name": name, "p50_ms": float(p50), "p95_ms": float(p95), "p99_ms": float(p99)}
