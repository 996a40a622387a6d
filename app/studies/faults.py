"""Sensors that fail while the arm works: does it run into anything, and what does it cost?

Experiment X6 of the specification, widened. Half a second after the start some sensors fail, in
one of the ways of `app.studies.faulty_skin`, or a hand lies on a window from the start. Before the
plate it is those that look most towards the goal, in the cell any, the same ones and more of them
for each number. The target is that the arm moves into nothing, and that with one sensor less a
laboratory's day goes on: most of the work is done that is done with all of them. The work is the
way along the program, and before the plate, behind which the goal lies, how near the tool has come
to it.
"""

import time
from collections import Counter
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.actions import AddObstacle
from app.judge.contact import Contacts
from app.judge.run import JUDGED_EVERY
from app.judge.truth import TrueDistance
from app.messages import Array, Mode, Snapshot
from app.plant.simulated import SimulatedPlant
from app.report import Check, Report
from app.runtime import Engine
from app.sensing.source import Source
from app.setup import Setup
from app.studies.faulty_skin import KINDS, FaultySkin
from app.studies.headless import step_until
from app.studies.pool import each
from app.timing import ManualClock
from app.wiring import build_engine

PANEL, CELL, PROGRAM = "front-panel", "cell", "door-screws"
SCENES = (PANEL, CELL)
COUNTS = (1, 3, 9, 14, 29)  # of the sensors that fail
NONE, HAND = "none", "hand"
AT = 0.5  # [s] when they fail
RATE = 125.0  # [Hz] of the ticks
GAP, RADIUS = 0.008, 0.045  # [m] of the hand to the window, and its radius
WORK = 0.8  # share of the work that is done with one sensor less


class FaultSpec(NamedTuple):
    """One run: what fails, of how many sensors, where."""

    scene: str
    kind: str
    sensors: int
    seed: int


def faults(
    seconds: float = 10.0, seed: int = 0, seeds: int = 1, *, world: str = "honest", jobs: int = 1,
    scenes: tuple[str, ...] = SCENES, counts: tuple[int, ...] = COUNTS,
) -> Report:  # fmt: skip
    """Every kind of fault, number of sensors and scene, `seeds` times; world: see `Setup`."""
    kinds = [(NONE, 0), (HAND, 1), *((kind, k) for kind in KINDS for k in counts)]
    specs = [
        FaultSpec(scene, kind, k, seed + i)
        for i in range(seeds) for scene in scenes for kind, k in kinds
    ]  # fmt: skip
    rows = sorted(
        each(partial(run_fault, seconds=seconds, world=world), specs, jobs),
        key=lambda r: specs.index(FaultSpec(r["scene"], r["kind"], r["sensors"], r["seed"])),
    )
    whole = {(r["scene"], r["seed"]): r["way_m"] for r in rows if r["kind"] == NONE}
    for r in rows:
        r["work"] = r["way_m"] / max(whole[r["scene"], r["seed"]], 1e-9)
    return Report("faults", seed, rows, checks(rows))


def checks(rows: list[dict[str, Any]]) -> list[Check]:
    """No contact is the arm's own; one sensor less leaves most of the work."""
    own = Check("contacts that the arm moved into", sum(r["own_contacts"] for r in rows), "", 0.0)
    return [own] + [
        Check(f"{r['name']}: work beside no fault", r["work"], "", WORK, at_least=True)
        for r in rows
        if r["sensors"] == 1 and r["kind"] in KINDS
    ]


def run_fault(spec: FaultSpec, seconds: float, world: str) -> dict[str, Any]:
    """One run, as a row; the work's share is not known yet."""
    began = time.perf_counter()
    program = PROGRAM if spec.scene == CELL else ""
    setup = Setup(scene=spec.scene, seed=spec.seed, rate=RATE, program=program, world=world)
    engine = build_engine(setup, ManualClock())
    assert isinstance(engine.plant, SimulatedPlant)
    eyes: list[FaultySkin] = []

    def spoil(source: Source) -> FaultySkin:
        eyes.append(FaultySkin(source, engine.skin, spec.kind, spec.seed))
        return eyes[-1]

    engine.plant.listen_through(spoil)
    watch = _Watch(engine, engine.plant, eyes[0], spec)
    last = step_until(engine, seconds, watch.update)
    return watch.row(last) | {"seconds": time.perf_counter() - began}


class _Watch:
    """Lets the sensors fail in time, and judges."""

    def __init__(
        self, engine: Engine, plant: SimulatedPlant, eye: FaultySkin, spec: FaultSpec
    ) -> None:
        self._engine, self._plant, self._eye, self._spec = engine, plant, eye, spec
        truth = TrueDistance([(b.vertices, b.faces) for b in plant.robot.bodies])
        shapes = plant.world.shapes()
        cell = {b.name for b in engine.cell.boxes if b.name in shapes}
        self._avoided = {name: shape for name, shape in shapes.items() if name not in cell}
        self._truth, self._contacts = truth, Contacts(plant.robot, truth, self._avoided)
        self._moving = np.flatnonzero(plant.robot.supports.any(axis=1))
        self._cell, self._judged, self._failed = cell, -np.inf, False
        self._least, self._way = np.inf, 0.0
        self._begin = self._nearest = np.nan  # [m] from the goal, at first and at best
        self._speed: list[float] = []
        self._goal: Array | None = None
        self._words: Counter[str] = Counter()

    def update(self, s: Snapshot) -> None:
        """Take note of one tick."""
        if not self._failed and (s.stamp >= AT or self._spec.kind == HAND):
            self._failed = True
            self._fail(s)
        at, toward = s.T_base_tool[:3, 3], s.goal.T_base_tool[:3, 3]
        if self._goal is not None and s.status.mode is not Mode.IDLE:
            self._way += float(np.linalg.norm(toward - self._goal))  # along the program
        self._goal = toward
        if s.stamp < self._judged + JUDGED_EVERY:
            return
        far = float(np.linalg.norm(toward - at))
        self._begin = far if np.isnan(self._begin) else self._begin
        self._nearest = float(np.fmin(self._nearest, far))
        if self._failed:
            self._speed.append(float(np.abs(s.joints.qd).max()))
            self._words[s.advice or s.status.reason] += 1
        self._judged, links = s.stamp, self._plant.true_poses()
        bodies = [b for b in s.world if b.view.name not in self._cell]
        self._contacts.update(s.stamp, s.joints.q, s.joints.qd, links, bodies)
        apart = self._truth.measure(links, self._plant.world, self._cell)[self._moving]
        self._least = min(self._least, float(apart.min()))

    def _fail(self, s: Snapshot) -> None:
        chosen, spec = self._chosen(s), self._spec
        if spec.kind == HAND:
            skin, k = self._engine.skin, int(chosen[0])
            T = s.T_base_link[skin.link[k]]
            lens = T[:3, :3] @ skin.origin[k] + T[:3, 3]
            x, y, z = (lens + (GAP + RADIUS) * T[:3, :3] @ skin.axis[k]).tolist()
            hand = AddObstacle(HAND, {"kind": "sphere", "radius_m": RADIUS}, (x, y, z))
            self._plant.act(hand)
            self._avoided[HAND] = self._plant.world.shapes()[HAND]
        elif spec.kind != NONE:
            self._eye.fail(chosen[: spec.sensors].tolist())

    def _chosen(self, s: Snapshot) -> NDArray[np.intp]:
        """The sensors in the order in which they fail."""
        skin = self._engine.skin
        if self._spec.scene == CELL:
            return np.random.default_rng([self._spec.seed, 6]).permutation(skin.count)
        T = s.T_base_link[skin.link]
        axis = np.einsum("kij,kj->ki", T[:, :3, :3], skin.axis)
        return np.argsort(-(axis @ (s.goal.T_base_tool[:3, 3] - s.T_base_tool[:3, 3])))

    def row(self, s: Snapshot) -> dict[str, Any]:
        """What came of it; `s` is the last tick's."""
        spec, own = self._spec, [c for c in self._contacts.found if c.moved_into]
        return {
            "name": f"{spec.scene} {spec.kind} {spec.sensors}",
            "scene": spec.scene,
            "kind": spec.kind,
            "sensors": spec.sensors,
            "seed": spec.seed,
            "own_contacts": len(own),
            "contacts": len(self._contacts.found),
            "own_mps": max((c.own for c in self._contacts.found), default=0.0),
            "least_m": self._least,
            "speed_rad_s": float(np.mean(self._speed)),
            "way_m": self._way if spec.scene == CELL else self._begin - self._nearest,
            "blind": s.blind,
            "status": f"{s.status.mode.value}: {s.status.reason}",
            "advice": self._words.most_common(1)[0][0],
        }
