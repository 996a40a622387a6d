"""The control step alone, from pairs to joint velocity, beside other software on the same pairs.

The moments are those of many short runs among still points, which the arm cannot all keep away
from; in one row of the report nothing of a tick is left in the next one. Others are given pairs
that are at least d_s away at first, since most of them have no answer inside of it; what they
left unsolved is counted. Beside them everyone's kinematics are inside of the clock, ours as well.
Times are given by the clock and by the thread's own processor time, since on a shared machine the
slowest per cent are mostly the waits for a processor.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from app.bench.control_cases import DT, FAR, Case, make_cases, make_runs
from app.bench.peers.controllers import available_peers
from app.bench.standalone import Standalone
from app.config import Params
from app.messages import Array
from app.report import Check, Report
from app.robot.model import Robot, find_robot, load_robot

WARM = 200
MANY = (1, 10, 100)  # pairs for which others are measured beside


def bench_control(steps: int = 2000, hard: int = 10_000, seed: int = 0) -> Report:
    """Times of every controller with 7, 12 and 32 pairs, and of the peers that import."""
    robot = load_robot(find_robot("ur10e"))
    rows: list[dict[str, Any]] = []
    medians: dict[str, float] = {}
    slow: dict[str, float] = {}

    closest, links = Standalone(robot, "wb"), Standalone(robot, "multi")
    bounds = Standalone(robot, "qp")
    wb, qp = Params(mode="wb"), Params(mode="qp")
    subjects: list[tuple[str, int, float, Any, Params]] = [
        ("task priority", 7, FAR, closest, wb),
        ("task priority, every link", 7, FAR, links, wb),
        ("qp", 7, FAR, bounds, qp),
        ("qp", 12, FAR, bounds, qp),
        ("qp", 32, FAR, bounds, qp),
        ("qp, all too near", 12, qp.distance_kept, bounds, qp),
        ("qp, all too near", 32, qp.distance_kept, bounds, qp),
    ]
    for name, k, far, control, params in subjects:
        cases = make_runs(robot, k, WARM + steps, seed, far)

        def step(c: Case, control: Any = control, params: Params = params) -> None:
            if c.first:
                control.reset()
            control.step(c, params, DT)

        title, times = f"{name}, {k} pairs", _times(step, cases)
        rows.append({"name": title, **times})
        medians[title], slow[title] = times["p50_ms"], times["p99_cpu_ms"]
    unsolved = _unsolved(robot, bounds, qp, hard, seed)
    rows.append({"name": "qp, new rows each tick", **unsolved})
    rows += _beside(robot, seed)
    checks = [
        Check("task priority, median", medians["task priority, 7 pairs"], "ms", 0.15),
        Check("qp with 12 pairs, median", medians["qp, 12 pairs"], "ms", 0.3),
        Check("qp with 32 pairs, median", medians["qp, 32 pairs"], "ms", 0.8),
        Check(
            "qp with 12 pairs all too near, median",
            medians["qp, all too near, 12 pairs"],
            "ms",
            0.3,
        ),
        Check(
            "qp with 32 pairs all too near, median",
            medians["qp, all too near, 32 pairs"],
            "ms",
            0.8,
        ),
        Check("qp, 99 % of processor time", max(slow[n] for n in slow if "qp" in n), "ms", 2.0),
        Check("qp, new rows each tick, 99 % of processor time", unsolved["p99_cpu_ms"], "ms", 2.0),
        Check(f"qp, unsolved of {hard}", float(unsolved["unsolved"]), "", 0.0),
    ]
    for r in rows:
        if "faster_than_peer" in r:
            checks.append(Check(f"{r['name']}: peer / ours", r["faster_than_peer"], "", 1.0, True))
    return Report("bench control", seed, rows, checks)


def _times(step: Callable[[Case], Any], cases: list[Case]) -> dict[str, float]:
    for c in cases[:WARM]:
        step(c)
    wall, cpu = np.empty(len(cases) - WARM), np.empty(len(cases) - WARM)
    for i, c in enumerate(cases[WARM:]):
        begin, used = time.perf_counter(), time.thread_time()
        step(c)
        wall[i], cpu[i] = time.perf_counter() - begin, time.thread_time() - used
    return _percentiles(wall, cpu)


def _percentiles(wall: Array, cpu: Array) -> dict[str, float]:
    p50, p95, p99 = 1e3 * np.percentile(wall, [50, 95, 99])
    return {
        "p50_ms": float(p50),
        "p95_ms": float(p95),
        "p99_ms": float(p99),
        "p50_cpu_ms": 1e3 * float(np.percentile(cpu, 50)),
        "p99_cpu_ms": 1e3 * float(np.percentile(cpu, 99)),
    }


def _unsolved(
    robot: Robot, control: Standalone, params: Params, count: int, seed: int
) -> dict[str, Any]:
    """Ticks without an answer when every row is new in each: 7, 12 and 32 pairs in turn."""
    cases = [make_cases(robot, k, 400, seed + 1) for k in (7, 12, 32)]
    wall, cpu, braked = np.empty(count), np.empty(count), 0
    control.reset()
    for i in range(count):
        c = cases[i % 3][(i // 3) % 400]
        begin, used = time.perf_counter(), time.thread_time()
        command = control.step(c, params, DT)
        wall[i], cpu[i] = time.perf_counter() - begin, time.thread_time() - used
        braked += command.reason.startswith("brakes")
        if i % 7 == 0:
            control.rest()
    return {"ticks": count, "unsolved": braked, **_percentiles(wall, cpu)}


def _beside(robot: Robot, seed: int) -> list[dict[str, Any]]:
    """Ours, a peer, ours again, on the same pairs; the peers that can be imported here."""
    control, params = Standalone(robot, "qp"), Params(mode="qp")
    rows: list[dict[str, Any]] = []
    for k in MANY:
        cases = make_runs(robot, k, WARM + 400, seed, near=params.distance_kept)

        def ours(c: Case) -> None:
            if c.first:
                control.reset()
            # the kinematics inside of the clock, as everyone's
            control.step(c._replace(posture=robot.posture(c.posture.q)), params, DT)

        for name, make in available_peers().items():
            if isinstance(make, str):
                if k == 1:
                    rows.append({"name": name, "left_out": make})
                continue
            before = _times(ours, cases)["p50_ms"]
            peer = make(robot, k)
            theirs = _times(peer, cases)
            after = _times(ours, cases)["p50_ms"]
            rows.append(
                {
                    "name": f"{name}, {k} pairs",
                    **theirs,
                    "unsolved": sum(not peer(c) for c in cases) / len(cases),
                    "ours_p50_ms": (before + after) / 2.0,
                    "faster_than_peer": theirs["p50_ms"] / ((before + after) / 2.0),
                }
            )
    return rows
