"""The paper's controller strictly as published, in the controller and in what it perceives."""

import numpy as np
import pytest

from app.actions import SetParams
from app.bench.control_cases import Case
from app.bench.standalone import Standalone
from app.config import Params
from app.control.registry import kinds
from app.messages import Goal, JointState, Pairs, Verdict
from app.perception.rules import PUBLISHED, Rules, rules_of
from app.setup import Setup
from app.studies.headless import run
from app.timing import ManualClock
from app.wiring import build_engine


@pytest.mark.parametrize(("mode", "low", "high"), [("paper", -0.02, 0.0), ("wb", 0.20, 0.30)])
def test_before_the_side_plate_the_strict_method_touches_and_the_improved_one_does_not(
    mode, low, high
):
    setup = Setup(scene="side-panel", rate=125.0, world="ideal")
    record, _ = run(setup, 8.0, Params(mode=mode, memory=False, distance_kept=0.25))
    assert low < min(record.true_distance) < high and not record.stops


def test_only_the_paper_asks_for_strictness_and_it_is_perception_that_knows_what_that_is():
    assert {k.name for k in kinds().values() if k.needs(Params()).as_published} == {"paper"}
    assert rules_of(Params(), as_published=True) == PUBLISHED
    assert rules_of(Params(), as_published=False) == Rules()


def test_strictness_leaves_out_every_rule_that_the_paper_does_not_have():
    """Whoever adds a rule must say what the paper does instead."""
    kept = [name for name, value in PUBLISHED._asdict().items() if value == Rules()._asdict()[name]]
    assert kept == []


def percepts(modes, ticks):
    """What each controller is told before the front panel, one after another on one arm."""
    engine = build_engine(Setup(scene="front-panel", rate=125.0, world="ideal"), ManualClock())
    perception, told = engine.brain._perception, {}
    update = perception.update

    def listened(*given):
        told[engine.brain.params.mode] = update(*given)
        return told[engine.brain.params.mode]

    perception.update = listened
    for mode in modes:
        engine.post(SetParams({"mode": mode}))
        for _ in range(ticks):
            snapshot = engine.step()
    return told, snapshot


def test_what_the_paper_is_told_is_measured_now_and_nothing_else():
    told, snapshot = percepts(["wb", "paper"], 200)
    for mode, percept in told.items():
        assert (percept.steady is percept.pairs) == (mode == "paper")
        assert (percept.pairs.approach is None) == (mode == "paper")
        assert (len(percept.memory) == 0) == (mode == "paper")
    believed = snapshot.cloud.verdict[snapshot.cloud.verdict != Verdict.EMPTY]
    assert Verdict.GHOST not in believed  # the last is the paper's


def test_what_calms_one_controllers_input_calms_all_but_the_papers():
    modes = [k.name for k in kinds().values()]
    told, _ = percepts(modes, 40)
    assert set(told) == set(modes)
    for mode, percept in told.items():
        assert (percept.steady.source is None) == (mode == "paper"), mode
        assert (percept.steady.approach is None) == (mode == "paper"), mode


def near(robot, link, distance, normal):
    """A pair of each link at its origin, with something at `distance` [m] against `normal`."""
    on = robot.posture(robot.home).T_base_link[link, :3, 3]
    n = np.array(normal, float)
    d = np.array(distance, float)
    closest = int(np.argmin(d))
    return Pairs(np.array(link), d, on, on - d[:, None] * n, n, np.arange(len(d)), closest)


def asked(robot, mode, *moments):
    """The last command of a controller that is told one set of pairs after the other."""
    control = Standalone(robot, mode)
    posture, still = robot.posture(robot.home), np.zeros(robot.n)
    goal = Goal(posture.T_base_tool)
    for pairs in moments:
        case = Case(posture, JointState(0.0, robot.home, still), pairs, goal)
        command = control.step(case, Params(mode=mode), 0.004)
    return command


def hardly_movable(robot, share):
    """A point of the shoulder's neighbour that one joint moves, mostly across its way."""
    link = int(np.flatnonzero(robot.supports.sum(axis=1) == 1)[0])
    posture = robot.posture(robot.home)
    on = posture.T_base_link[link, :3, 3] + [0.1, 0.0, 0.0]
    along = np.array([0.0, share, np.sqrt(1.0 - share**2)])
    d = np.array([0.1])
    return Pairs(np.array([link]), d, on[None], (on - 0.1 * along)[None], along[None],
                 np.arange(1), 0)  # fmt: skip


def test_no_cap_spares_a_point_that_the_joints_can_hardly_move(robot):
    pairs = hardly_movable(robot, 1.0)
    assert asked(robot, "paper", pairs).reference == pytest.approx(2.0 * (0.30 - 0.10))
    assert asked(robot, "wb", pairs).reference < 0.1
    nearly_none = hardly_movable(robot, 0.2)
    assert asked(robot, "paper", nearly_none).control_row == 0
    assert asked(robot, "wb", nearly_none).control_row == -1


def test_the_nearest_pair_is_acted_on_and_none_is_held_on_to(robot):
    links, away = [5, 6], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    first, then = near(robot, links, [0.20, 0.21], away), near(robot, links, [0.205, 0.20], away)
    assert asked(robot, "paper", first, then).control_row == 1
    assert asked(robot, "wb", first, then).control_row == 0
