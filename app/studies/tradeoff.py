"""Clearance against goal completion: the paper's controller and the QP in the same scenes.

The plates before the goal show steady distance, smoothness and chatter; the cell with its
person and a waypoint program shows what the distance costs. The QP is run over a range of d_s,
the task priority over the d_min that keeps its retreat at the same distance. The QP has memory
and several pairs a link, as it is meant to be run; the paper's controller is shown without, as
published, and with memory.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from app.config import ControlMode, Params
from app.control.goals import goal_error
from app.messages import Array
from app.studies.headless import Judge
from app.studies.report import Check, Report
from app.timing import ManualClock
from app.wiring import Setup, build_engine

PLATES = ("front-panel", "side-panel")
CELL, PROGRAM = "cell", "door-screws"
RUNS: tuple[tuple[ControlMode, bool], ...] = (
    ("wb", False), ("wb", True), ("multi", True), ("qp", True),
)  # fmt: skip
STILL = 3.0  # [s] from here on a plate's scene has settled: chatter is counted from then
D_MIN = 0.20  # [m] time above it is compared


@dataclass(frozen=True)
class Point:
    """One controller with one distance setting in one scene."""

    scene: str
    mode: ControlMode
    memory: bool
    kept: float

    @property
    def name(self) -> str:
        """The controller in words."""
        return f"{self.mode} with memory" if self.memory and self.mode != "qp" else self.mode

    def params(self) -> Params:
        """`kept` [m]: d_s of the QP; the task priority begins to give way 5 cm before it."""
        if self.mode == "qp":
            return Params(mode="qp", d_s=self.kept, memory=self.memory)
        d_min = max(self.kept - 0.05, 0.05)
        return replace(Params(), mode=self.mode, d_min=d_min, memory=self.memory)


def tradeoff(
    kept: tuple[float, ...] = (0.15, 0.20, 0.25), seconds: float = 8.0,
    cell_seconds: float = 40.0, seed: int = 0, rate: float = 125.0,
) -> Report:  # fmt: skip
    """Every mode, scene and distance; the rows are the points of the plot."""
    plates = [Point(s, *run, d) for s in PLATES for run in RUNS for d in kept]
    cells = [Point(CELL, *run, d) for run in RUNS for d in kept]
    rows = [run_point(p, seconds, seed, rate) for p in plates]
    rows += [run_point(p, cell_seconds, seed, rate) for p in cells]
    return Report("trade-off", seed, rows, _checks(rows))


def run_point(p: Point, seconds: float, seed: int, rate: float) -> dict[str, Any]:
    """One run, as a row."""
    program = PROGRAM if p.scene == CELL else ""
    setup = Setup(scene=p.scene, seed=seed, rate=rate, program=program)
    engine = build_engine(setup, ManualClock(), p.params())
    judge = Judge(engine)
    qd, held = [], []
    while True:
        s = engine.step()
        judge.see(s)
        qd.append(s.command.qd)
        held.append(s.command.activation > 0.0)
        if s.stamp >= seconds:
            break
    r = judge.record
    true = np.array(r.true_distance)
    distal = np.array(r.distal_distance)  # what hardly moves is as near with any controller
    late = int(STILL * rate)
    error, _ = goal_error(s.T_base_tool, s.goal.T_base_tool)
    return {
        "name": f"{p.scene} {p.name} {p.kept:g}",
        "scene": p.scene,
        "mode": p.name,
        "kept_m": p.kept,
        "least_m": float(true.min()),
        "distal_least_m": float(distal.min()),
        "distal_p5_m": float(np.percentile(distal, 5)),
        "steady_m": r.steady(2.0),
        "above_d_min": float((true >= D_MIN).mean()),
        "distal_above_d_min": float((distal >= D_MIN).mean()),
        "waypoints_per_min": 60.0 * engine.reached / seconds,
        "goal_error_m": error,
        "jerk_rms": jerk_rms(np.array(qd), rate),
        "switches_per_s": switches(held[late:]) / max(seconds - STILL, 1e-9),
        "stops": len(r.stops),
    }


def jerk_rms(qd: Array, rate: float) -> float:
    """Root mean square [rad/s^3] of the second difference of commands (T, n)."""
    return float(np.sqrt(np.mean(np.square(np.diff(qd, n=2, axis=0) * rate * rate))))


def switches(held: list[bool]) -> int:
    """How often the avoidance began or ended."""
    return int(np.count_nonzero(np.diff(np.array(held, dtype=int))))


def _checks(rows: list[dict[str, Any]]) -> list[Check]:
    """The QP beside WB, without and with memory, at the same distance setting."""
    pairs = [
        (a, b)
        for a in rows
        for b in rows
        if a["mode"] == "qp" and b["mode"] in ("wb", "wb with memory")
        if a["scene"] == b["scene"] and a["kept_m"] == b["kept_m"]
    ]
    checks = []
    for a, b in pairs:
        where = f"{a['scene']} {a['kept_m']:g}" + ("" if b["mode"] == "wb" else ", wb with memory")
        gain = a["least_m"] - b["least_m"]
        checks.append(Check(f"{where}: least, qp - wb", gain, "m", 0.0, at_least=True))
        gain = a["above_d_min"] - b["above_d_min"]
        checks.append(Check(f"{where}: time above d_min, qp - wb", gain, "", 0.0, at_least=True))
        if a["scene"] == CELL:
            gain = a["waypoints_per_min"] - b["waypoints_per_min"]
            checks.append(Check(f"{where}: waypoints, qp - wb", gain, "1/min", 0.0, at_least=True))
        else:
            ratio = a["jerk_rms"] / b["jerk_rms"]
            checks.append(Check(f"{where}: jerk, qp / wb", ratio, "", 0.2))
    for a in rows:
        if a["mode"] == "qp" and a["scene"] in PLATES:
            short = a["steady_m"] - a["kept_m"]
            checks.append(Check(f"{a['name']}: steady - d_s", short, "m", -0.02, at_least=True))
            chatter = a["switches_per_s"]
            checks.append(Check(f"{a['name']}: chatter", chatter, "1/s", 1.0))
    return checks
