"""A trial as it is run: an engine built from names, watched by judges, stepped to its end."""

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from app.actions import AddObstacle
from app.config import Params
from app.judge.encounter import Encounter, Notes
from app.messages import Snapshot
from app.plant.simulated import SimulatedPlant
from app.robot.skin import Skin
from app.runtime import Engine
from app.sensing.source import Source
from app.setup import Setup
from app.studies.conditions import HAND, Condition
from app.studies.faulty_skin import FaultySkin
from app.studies.headless import Ready, nothing, step_until
from app.studies.one_pair import OnePairALink
from app.studies.oracle import TruePerception
from app.studies.trial import TrialResult, TrialSpec
from app.timing import ManualClock
from app.wiring import build_engine
from app.world.scene import Scene

FAILS_AT = 0.5  # [s]
GAP, RADIUS = 0.008, 0.045  # [m] of a hand to the window, and its radius


class Watcher(Protocol):
    """Whatever an experiment looks at beside the figures that all have."""

    def update(self, s: Snapshot) -> None: ...
    def figures(self) -> dict[str, Any]: ...
    def marks(self) -> list[list[Any]]: ...


class Case(NamedTuple):
    """What a trial needs.

    watch: makes the experiment's own watcher of the engine, before its first tick; it may act.
    scene: instead of the setup's file.   more: figures from what was noted of the trial.
    first: the sensors in the order in which they fail; None: in the seed's.
    """

    setup: Setup
    params: Params
    watch: Callable[[Engine], Watcher] | None = None
    scene: Scene | None = None
    more: Callable[[Notes], dict[str, Any]] | None = None
    first: Callable[[Snapshot, Skin], NDArray[np.intp]] | None = None


def setup_of(spec: TrialSpec, c: Condition, scene: str, **more: Any) -> Setup:
    """The setup of a trial in a scene, in the condition's world and skin."""
    if c.program:
        more["program"] = c.program
    return Setup(
        scene=scene, seed=spec.seed, rate=spec.rate, world=c.budget(spec.world),
        skin=c.skin or spec.skin, **more,
    )  # fmt: skip


def run_case(spec: TrialSpec, c: Condition, case: Case, ready: Ready = nothing) -> TrialResult:
    """The trial from beginning to end; ready: is given the engine before its first tick."""
    engine = build_case(case, c)
    try:
        fail = _failing(engine, case, c, spec.seed) if c.fault else None
        ready(engine)
        watch = Encounter(engine)
        own = case.watch(engine) if case.watch else None
    except BaseException:
        engine.close()
        raise

    def look(s: Snapshot) -> None:
        if fail is not None and s.stamp >= FAILS_AT:
            fail(s)
        watch.update(s)
        if own is not None:
            own.update(s)

    step_until(engine, spec.seconds, look)
    figures = watch.figures(case.params.distance_kept, spec.rate)
    if c.oracle:
        del figures["seen_share"]  # it has no cloud
    if case.more is not None:
        figures |= case.more(watch.notes)
    marks = []
    if own is not None:
        figures |= own.figures()
        marks = own.marks()
    return TrialResult(spec.seed, spec.condition, figures, watch.course(), marks)


def build_case(case: Case, c: Condition) -> Engine:
    """The engine of a trial, not yet stepped."""
    perceive = TruePerception if c.oracle else OnePairALink if c.one_pair else None
    return build_engine(case.setup, ManualClock(), case.params, perceive, case.scene)


def _failing(
    engine: Engine, case: Case, c: Condition, seed: int
) -> Callable[[Snapshot], None] | None:
    """Lets sensors fail, the same ones and more of them for each number.

    Hands are there before any judge looks at the world; None then.
    """
    assert isinstance(engine.plant, SimulatedPlant)
    skin = engine.skin
    by_chance = np.random.default_rng([seed, 6]).permutation(skin.count)

    def chosen(s: Snapshot) -> list[int]:
        order = case.first(s, skin) if case.first is not None else by_chance
        return [int(k) for k in order[: c.failing]]

    if c.fault == HAND:
        s = engine.step()
        for k in chosen(s):
            engine.plant.act(hand_on(s, skin, k))
        return None
    eyes: list[FaultySkin] = []

    def spoil(source: Source) -> FaultySkin:
        eyes.append(FaultySkin(source, skin, c.fault, seed))
        return eyes[-1]

    engine.plant.listen_through(spoil)

    def fail(s: Snapshot) -> None:
        if not eyes[0].failed:
            eyes[0].fail(chosen(s))

    return fail


def hand_on(s: Snapshot, skin: Skin, sensor: int) -> AddObstacle:
    """A hand that lies almost on a sensor's window."""
    T = s.T_base_link[skin.link[sensor]]
    lens = T[:3, :3] @ skin.origin[sensor] + T[:3, 3]
    x, y, z = (lens + (GAP + RADIUS) * T[:3, :3] @ skin.axis[sensor]).tolist()
    return AddObstacle(HAND, {"kind": "sphere", "radius_m": RADIUS}, (x, y, z))
