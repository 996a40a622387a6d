"""How many ticks begin too late, by sensors and rate, with a page being looked at.

From cloud to joint velocity and the page in one process, as in a demonstration: with simulated
sensors (their frames come from a process of their own), and with a board that speaks for a
whole skin on a pseudo terminal. A deadline is missed when a tick begins more than one period
late. An empty loop of the same rate runs before and after: what it misses is the machine's.
"""

import gc
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np

from app.choices import build_robot_and_skin
from app.report import Check, Report
from app.robot.arm import SimulatedArm
from app.robot.model import Robot
from app.robot.skin import Skin, build_skin
from app.runtime import Engine
from app.sensing.budget import HONEST
from app.sensing.open_ports import open_skin
from app.sensing.simulated_apart import SimulatedSkinApart
from app.sensing.source import Source
from app.setup import Setup
from app.timing import Ticker, WallClock
from app.virtual.skin.board import speaking_board
from app.wiring import PICTURE, Start, assemble
from app.world.scene import Scene, find_scene, load_scene
from app.world.world import World

SENSORS, RATES = (3, 10, 30, 100), (125.0, 250.0, 500.0)
ROBOT, SCENE = "ur10e", "cell"
SETTLE = 2.0  # [s] before counting
MISSED = 1.0  # [%] of ticks that may be missed: 30 simulated sensors at 250 Hz, a pty's at 500
Watch = Callable[[Engine], AbstractContextManager[None]]


def bench_deadlines(watch: Watch, seconds: float = 5.0, seed: int = 0) -> Report:
    """Every number of sensors at every rate, with `watch` looking on."""
    robot, own = build_robot_and_skin(Setup(robot=ROBOT))
    scene = load_scene(find_scene(SCENE), seed)
    rows: list[dict[str, Any]] = []
    checks = []
    for rate in RATES:
        before = _empty(rate, seconds)
        mine = {}
        for n in SENSORS:
            skin = build_skin("many", tuple(own.sensors[i % own.count] for i in range(n)), robot)
            world = World(scene.bodies)
            eye = SimulatedSkinApart(robot, skin, world, seed, budget=HONEST)
            eye.wait()
            mine[f"{n} sensors"] = _run(watch, robot, skin, scene, eye, world, rate, seconds)
        with speaking_board(ROBOT, SCENE, seed) as port:
            real = open_skin(str(port), own, WallClock())
            mine[f"{own.count} sensors on a pty"] = _run(
                watch, robot, own, scene, real, None, rate, seconds
            )
        rows.append(_row(f"{rate:g} Hz, empty loop", before + _empty(rate, seconds), rate))
        rows += [_row(f"{rate:g} Hz, {name}", late, rate) for name, late in mine.items()]
        for name, at in (("30 sensors", 250.0), ("30 sensors on a pty", 500.0)):
            if rate == at:
                missed = 100.0 * float(np.mean(np.array(mine[name]) > 1.0 / rate))
                checks.append(Check(f"{name} at {at:g} Hz, missed", missed, "%", MISSED))
    return Report("bench deadlines", seed, rows, checks)


def _run(
    watch: Watch, robot: Robot, skin: Skin, scene: Scene, source: Source, world: World | None,
    rate: float, seconds: float,
) -> list[float]:  # fmt: skip
    arm = SimulatedArm(robot, scene.home)
    engine = assemble(
        robot, skin, arm, source, world, WallClock(),
        Start(scene.cell, goal=scene.goal, look_every=PICTURE), rate,
    )  # fmt: skip
    try:
        with watch(engine):
            engine.start()
            time.sleep(SETTLE)
            engine.ticker.lateness.clear()
            gc.collect()
            time.sleep(seconds)
            return list(engine.ticker.lateness)
    finally:
        engine.close()


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
