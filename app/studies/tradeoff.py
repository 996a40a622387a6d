"""Clearance against goal completion: the paper's controller and the QP in the same scenes.

The plates before the goal show steady distance, smoothness and chatter; the cell with its
person and a waypoint program shows what the distance costs. Every point is a mean over several
seeds, each with other sensors and other habits of the person. The QP is run over a range of d_s,
the task priority over the d_min that keeps its retreat at the same distance. The QP has memory
and several pairs a link, as it is meant to be run; the paper's controller is shown strictly as
published, and as improved here without and with memory.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from app.config import Params
from app.control.goals import goal_error
from app.control.registry import kind_of, taking_part
from app.judge.metrics import jerk_rms
from app.judge.run import Judge
from app.messages import Array, Snapshot
from app.report import Check, Report
from app.setup import Setup
from app.studies.headless import step_until
from app.studies.pool import each
from app.timing import ManualClock
from app.wiring import build_engine

PLATES = ("front-panel", "side-panel")
CELL, PROGRAM = "cell", "door-screws"
OURS, BESIDE = Params().mode, "wb"  # whose figures are checked against whose
STILL = 3.0  # [s] from here on a plate's scene has settled: chatter is counted from then
D_MIN = 0.20  # [m] time above it is compared


@dataclass(frozen=True)
class Point:
    """One controller with one distance setting in one scene."""

    scene: str
    mode: str
    memory: bool
    kept: float

    @property
    def name(self) -> str:
        """The controller in words."""
        usual = self.memory == kind_of(self.mode).memory[0]
        return self.mode if usual else f"{self.mode} {'with' if self.memory else 'without'} memory"

    def params(self) -> Params:
        """The settings that keep `kept` [m]."""
        return Params(mode=self.mode, memory=self.memory, distance_kept=self.kept)


class PointSpec(NamedTuple):
    """One run of a point; see `run_point`."""

    point: Point
    seconds: float
    seed: int
    rate: float
    world: str


@dataclass(frozen=True)
class Extent:
    """What is run: scenes, distances kept [m], length [s] of runs before a plate and beside the
    person, how many of each point, and the rate [Hz] of their ticks."""

    scenes: tuple[str, ...] = (*PLATES, CELL)
    kept: tuple[float, ...] = (0.10, 0.15, 0.20, 0.25, 0.30)
    seconds: float = 8.0
    cell_seconds: float = 40.0
    seeds: int = 3
    rate: float = 125.0


def tradeoff(
    extent: Extent = Extent(), seed: int = 0, *, jobs: int = 1, world: str = "honest"
) -> Report:
    """Every controller; the rows are the points of the plot, each of several seeds.

    world: error budget of the simulation.
    """
    e = extent
    runs = [(kind.name, memory) for kind in taking_part("tradeoff") for memory in kind.memory]
    points = [Point(scene, *run, d) for scene in e.scenes for run in runs for d in e.kept]
    specs = [
        PointSpec(p, e.cell_seconds if p.scene == CELL else e.seconds, seed + i, e.rate, world)
        for p in points for i in range(e.seeds)
    ]  # fmt: skip
    found = dict(each(run_spec, specs, jobs))
    rows = [mean([found[s] for s in specs if s.point == p]) for p in points]
    return Report("trade-off", seed, rows, checks(rows))


def mean(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The same point with several seeds, as a row."""
    return {
        key: float(np.mean([r[key] for r in rows])) if isinstance(value, float) else value
        for key, value in rows[0].items()
    } | {
        "worst_m": min(r["distal_least_m" if r["scene"] == CELL else "least_m"] for r in rows),
        "seeds": len(rows),
        "stops": sum(r["stops"] for r in rows),
    }


def run_spec(spec: PointSpec) -> tuple[PointSpec, dict[str, Any]]:
    """The row of a specification, and whose it is."""
    return spec, run_point(*spec)


def run_point(
    p: Point, seconds: float, seed: int, rate: float, world: str = "honest"
) -> dict[str, Any]:
    """One run, as a row."""
    program = PROGRAM if p.scene == CELL else ""
    setup = Setup(scene=p.scene, seed=seed, rate=rate, program=program, world=world)
    engine = build_engine(setup, ManualClock(), p.params())
    judge = Judge(engine)
    qd: list[Array] = []
    held: list[bool] = []

    def note(s: Snapshot) -> None:
        qd.append(s.command.qd)
        held.append(s.command.activation > 0.0)

    s = step_until(engine, seconds, judge.update, note)
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
        "waypoints_per_min": 60.0 * s.reached / seconds,
        "goal_error_m": error,
        "jerk_rms": jerk_rms(np.array(qd), rate),
        "switches_per_s": switches(held[late:]) / max(seconds - STILL, 1e-9),
        "stops": len(r.stops),
    }


def switches(held: list[bool]) -> int:
    """How often the avoidance began or ended."""
    return int(np.count_nonzero(np.diff(np.array(held, dtype=int))))


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """The QP beside WB, without and with memory: before the plates at the same distance setting,
    in the cell where it reaches at least as many waypoints."""
    ours = [r for r in rows if r["mode"] == OURS]
    out = []
    for b in rows:
        if b["mode"] not in (BESIDE, f"{BESIDE} with memory"):
            continue
        in_cell = b["scene"] == CELL
        beside = [
            a
            for a in ours
            if a["scene"] == b["scene"]
            if in_cell or a["kept_m"] == b["kept_m"]
            if a["waypoints_per_min"] >= b["waypoints_per_min"]
        ]
        least, above = (
            ("distal_least_m", "distal_above_d_min") if in_cell else ("least_m", "above_d_min")
        )
        for words, key, unit in (("least", least, "m"), ("time above d_min", above, "")):
            gain = max((a[key] - b[key] for a in beside), default=-np.inf)
            out.append(Check(f"{b['name']}: {words}, {OURS} - it", gain, unit, 0.0, at_least=True))
        if not in_cell:
            ratio = beside[0]["jerk_rms"] / b["jerk_rms"]
            out.append(Check(f"{b['name']}: jerk, {OURS} / it", ratio, "", 0.2))
    for a in rows:
        if a["mode"] == OURS and a["scene"] in PLATES:
            short = a["steady_m"] - a["kept_m"]
            out.append(Check(f"{a['name']}: steady - d_s", short, "m", -0.02, at_least=True))
            chatter = a["switches_per_s"]
            out.append(Check(f"{a['name']}: chatter", chatter, "1/s", 1.0))
    return out
