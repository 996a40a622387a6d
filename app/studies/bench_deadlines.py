"""How many ticks begin too late, by sensors and rate, with a page being looked at.

From cloud to joint velocity, the simulated sensors and the page in one process, as in a
demonstration. A deadline is missed when a tick begins more than one period late. An empty
loop of the same rate runs before and after: what it misses is the machine's.
"""

import gc
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np

from app.robot.arm import SimulatedArm
from app.robot.model import find_robot, load_robot
from app.robot.skin import build_skin, load_skin
from app.runtime import Engine
from app.sensing.simulated import SimulatedSkin
from app.studies.report import Check, Report
from app.timing import Ticker, WallClock
from app.world.scene import find_scene, load_scene
from app.world.world import World

SENSORS, RATES = (3, 10, 30, 100), (125.0, 250.0, 500.0)
SETTLE = 1.0  # [s] before counting
Watch = Callable[[Engine], AbstractContextManager[None]]


def bench_deadlines(watch: Watch, seconds: float = 5.0, seed: int = 0) -> Report:
    """Every number of sensors at every rate, with `watch` looking on."""
    rows: list[dict[str, Any]] = []
    checks = []
    for rate in RATES:
        before = _empty(rate, seconds)
        mine = [_run(watch, n, rate, seconds, seed) for n in SENSORS]
        after = _empty(rate, seconds)
        rows.append(_row(f"{rate:g} Hz, empty loop", before + after, rate))
        for n, late in zip(SENSORS, mine, strict=True):
            rows.append(_row(f"{rate:g} Hz, {n} sensors", late, rate))
            if (n, rate) == (30, 250.0):
                missed = 100.0 * float(np.mean(np.array(late) > 1.0 / rate))
                checks.append(Check("30 sensors at 250 Hz, missed", missed, "%", 1.0))
    return Report("bench deadlines", seed, rows, checks)


def _run(watch: Watch, count: int, rate: float, seconds: float, seed: int) -> list[float]:
    robot = load_robot(find_robot("ur10e"))
    assert robot.skin is not None
    own = load_skin(robot.folder / robot.skin, robot)
    skin = build_skin("many", tuple(own.sensors[i % own.count] for i in range(count)), robot)
    scene = load_scene(find_scene("cell"), seed)
    world = World(scene.bodies)
    source = SimulatedSkin(robot, skin, world, seed)
    arm, clock = SimulatedArm(robot, scene.home), WallClock()
    engine = Engine(
        robot, skin, arm, source, world, clock, goal=scene.goal, rate=rate, cell=scene.cell
    )
    with watch(engine):
        engine.start()
        try:
            time.sleep(SETTLE)
            engine.ticker.lateness.clear()
            gc.collect()
            time.sleep(seconds)
            return list(engine.ticker.lateness)
        finally:
            engine.stop()


def _empty(rate: float, seconds: float) -> list[float]:
    ticker = Ticker(WallClock(), 1.0 / rate)
    for _ in range(int(seconds * rate)):
        ticker.wait()
    return list(ticker.lateness)


def _row(name: str, late: list[float], rate: float) -> dict[str, Any]:
    p50, p99 = 1e3 * np.percentile(late, [50, 99])
    missed = int(np.sum(np.array(late) > 1.0 / rate))
    return {
        "name": name, "late_p50_ms": float(p50), "late_p99_ms": float(p99),
        "missed": missed, "ticks": len(late), "missed_percent": 100.0 * missed / len(late),
    }  # fmt: skip
