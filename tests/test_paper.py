"""The paper's controller strictly as published, in the controller and in what it perceives."""

import pytest

from app.actions import SetParams
from app.config import Params
from app.control.registry import kinds
from app.messages import Verdict
from app.perception.rules import Rules, rules_of
from app.studies.headless import run
from app.timing import ManualClock
from app.wiring import Setup, build_engine


@pytest.mark.parametrize(("mode", "low", "high"), [("paper", -0.02, 0.0), ("wb", 0.20, 0.30)])
def test_before_the_side_plate_the_strict_method_touches_and_the_improved_one_does_not(
    mode, low, high
):
    setup = Setup(scene="side-panel", rate=125.0, world="ideal")
    record, _ = run(setup, 8.0, Params(mode=mode, memory=False, distance_kept=0.25))
    assert low < min(record.true_distance) < high and not record.stops


def test_only_the_paper_asks_for_strictness_and_it_is_perception_that_knows_what_that_is():
    assert {k.name for k in kinds().values() if k.needs(Params()).as_published} == {"paper"}
    strict = rules_of(Params(), as_published=True)
    assert strict.two_sided and not (strict.footprint or strict.doubts_ghosts)
    assert not (strict.memory or strict.obstacle_speed)
    assert rules_of(Params(), as_published=False) == Rules()


def test_what_the_paper_is_told_is_measured_now_and_nothing_else():
    engine = build_engine(Setup(scene="front-panel", rate=125.0, world="ideal"), ManualClock())
    perception, told = engine.brain._perception, []
    update = perception.update
    perception.update = lambda *given: told.append(update(*given)) or told[-1]
    for mode in ("wb", "paper"):
        engine.post(SetParams({"mode": mode}))
        for _ in range(200):
            snapshot = engine.step()
        percept = told[-1]
        assert (percept.steady is percept.pairs) == (mode == "paper")
        assert (percept.pairs.approach is None) == (mode == "paper")
        assert (len(percept.memory) == 0) == (mode == "paper")
        believed = snapshot.cloud.verdict[snapshot.cloud.verdict != Verdict.EMPTY]
    assert Verdict.GHOST not in believed  # the last is the paper's
