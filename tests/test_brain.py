"""The brain: pure, deterministic, whole after a reset, and free of what is long gone."""

import pickle
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from app.actions import AddObstacle, RemoveObstacle, RunProgram, SetGoal, SetMode, SetParams
from app.brain import Brain
from app.config import Params
from app.digest import digest
from app.messages import Goal, Mode
from app.plant.recorded import RecordedPlant
from app.robot.arm import SimulatedArm
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.setup import Setup
from app.tick import ArmReport, Limits
from app.timing import ManualClock
from app.wiring import Start, assemble, build_engine
from app.world.world import World

CELL = Setup(scene="cell", seed=1, rate=125.0, program="door-screws")
AGAIN = """
import pickle, sys
from app.digest import digest
from app.timing import ManualClock
from app.wiring import build_engine

setup, inputs = pickle.loads(sys.stdin.buffer.read())
brain = build_engine(setup, ManualClock()).brain
print(*[digest(brain.tick(x)) for x in inputs], brain.digest())
"""


def recorded(setup, seconds, *, params=None, digests=False):
    """The engine after `seconds` of simulated time, its ticks, and the digests after each."""
    engine = build_engine(setup, ManualClock(), params)
    ticks, states = engine.subscribe(100_000), []
    for i in range(round(seconds * setup.rate)):
        if i == 40:
            engine.post(AddObstacle("ball", {"kind": "sphere", "radius_m": 0.08}, (0.5, 0.5, 0.5)))
        if i == 120:
            engine.post(SetMode(Mode.HOLDING))
        if i == 160:
            engine.post(SetMode(Mode.RUNNING))
        engine.step()
        if digests:
            states.append(engine.brain.digest())
    return engine, ticks.take(), states


def test_the_same_inputs_give_the_same_outputs_in_another_process():
    engine, ticks, _ = recorded(CELL, 2.0)
    inputs = pickle.dumps((CELL, [x for x, _ in ticks]))
    out = subprocess.run([sys.executable, "-c", AGAIN], input=inputs, capture_output=True)
    assert out.returncode == 0, out.stderr.decode()
    ours = [digest(o) for _, o in ticks]
    assert out.stdout.decode().split() == [*ours, engine.brain.digest()]


def same_again(seconds):
    engine, ticks, states = recorded(CELL, seconds, digests=True)
    plant = RecordedPlant([x for x, _ in ticks], engine.plant.limits)
    brain = engine.brain.sibling("qp")
    for before in states:
        brain.tick(plant.whole())
        assert brain.digest() == before
    assert plant.left == 0


def test_a_run_recorded_in_memory_and_run_again_has_the_same_state_at_every_tick():
    same_again(1.6)


@pytest.mark.slow
def test_a_minute_of_the_cell_run_again_has_the_same_state_at_every_tick():
    same_again(60.0)


def test_after_a_reset_the_brain_is_as_it_was_born():
    engine, ticks, _ = recorded(CELL, 1.6)
    inputs = [x for x, _ in ticks]
    born = engine.brain.sibling("qp").digest()
    used = engine.brain
    assert used.digest() != born
    used.reset()
    assert used.digest() == born
    other = used.sibling("qp")
    for x in inputs:
        assert digest(used.tick(x)) == digest(other.tick(x))


def test_the_digest_tells_any_change_and_refuses_what_it_cannot_read():
    state = {"a": [1.0, np.zeros(3)], "b": Mode.IDLE}
    assert digest(state) == digest({"a": [1.0, np.zeros(3)], "b": Mode.IDLE})
    for other in ({"a": [1.0, np.ones(3)], "b": Mode.IDLE}, {"a": [1.0], "b": Mode.IDLE}):
        assert digest(state) != digest(other)
    assert digest(state) != digest(state | {"b": Mode.RUNNING})
    assert digest(-0.0) != digest(0.0)
    with pytest.raises(TypeError, match="memoryview"):
        digest([memoryview(b"x")])


class Bench:
    """An engine with its parts within reach, on a manual clock."""

    def __init__(self, robot, skin, arm=None, rate=250.0, **how):
        self.world, self.arm = World(()), arm or SimulatedArm(robot)
        self.eye = SimulatedSkin(robot, skin, self.world, 0, ErrorModel(ideal=True))
        self.engine = assemble(
            robot, skin, self.arm, self.eye, self.world, ManualClock(), Start(**how), rate
        )

    def run(self, seconds, *actions):
        for action in actions:
            self.engine.post(action)
        for _ in range(round(seconds / self.engine.ticker.period)):
            snapshot = self.engine.step()
        return snapshot


def beside_the_forearm(robot, snapshot, gap):
    forearm = snapshot.T_base_link[robot.link_index("forearm_link")]
    return tuple(forearm[:3, :3] @ [-0.3, gap, 0.04] + forearm[:3, 3])


@pytest.mark.parametrize(
    ("mode", "memory"),
    [
        ("qp", True), ("wb", True),
        *(pytest.param(mode, False, marks=pytest.mark.slow) for mode in ("qp", "multi", "sm")),
    ],
)  # fmt: skip
def test_what_left_while_the_arm_was_stopped_does_not_move_it_when_it_runs_again(
    robot, skin, mode, memory
):
    bench = Bench(robot, skin, params=Params(mode=mode, memory=memory), rate=50.0)
    place = beside_the_forearm(robot, bench.run(0.3), 0.17)
    bench.run(0.25, AddObstacle("ball", {"kind": "sphere", "radius_m": 0.05}, place))
    stopped = bench.run(0.5, SetMode(Mode.STOPPED))
    assert stopped.body.minimum < 0.3  # it was there when Stop was pressed
    at_rest = bench.run(35.0, RemoveObstacle("ball"))
    assert at_rest.body.closest == -1
    bench.engine.post(SetMode(Mode.HOLDING))
    for _ in range(50):
        s = bench.engine.step()
        assert s.command.activation == 0.0 and np.abs(s.command.qd).max() < 1e-6
    assert np.abs(s.joints.q - at_rest.joints.q).max() < 1e-6


class SlowArm(SimulatedArm):
    """Allows little of itself, and says how much of that it allows now."""

    said = ArmReport()

    def __init__(self, robot):
        super().__init__(robot)
        self.limits = Limits(np.full(robot.n, 0.2), np.full(robot.n, 1.0))
        self.asked = []

    def report(self, now):
        return self.said

    def send(self, qd, dt):
        self.asked.append(qd)
        return super().send(qd, dt)


@pytest.mark.parametrize("mode", ["qp", "wb"])
def test_the_controller_plans_with_the_limits_that_the_arm_publishes(robot, skin, mode):
    arm = SlowArm(robot)
    bench = Bench(robot, skin, arm, params=Params(mode=mode, joint_speed=1.0))
    T = np.array(bench.run(0.2).T_base_tool)
    T[:3, 3] += [0.0, -0.5, 0.1]
    bench.run(2.0, SetGoal(T))
    fastest = np.abs(arm.asked).max()
    assert 0.15 < fastest <= 0.2 + 1e-12
    assert np.abs(np.diff(arm.asked, axis=0)).max() <= 1.0 * 0.004 + 1e-9
    arm.said = ArmReport(pace=0.25)
    bench.run(1.0)
    arm.asked.clear()
    bench.run(1.0)
    assert np.abs(arm.asked).max() <= 0.05 + 1e-9


class HalfDeafArm(SimulatedArm):
    """Takes half of what it is told, and says so."""

    def send(self, qd, dt):
        return super().send(qd / 2.0, dt)


def test_what_was_applied_is_read_by_the_next_tick_and_the_controller_goes_on_from_it(robot, skin):
    bench = Bench(robot, skin, HalfDeafArm(robot), params=Params(joint_speed=1.0))
    ticks = bench.engine.subscribe(1000)
    T = np.array(bench.run(0.2).T_base_tool)
    T[:3, 3] += [0.0, -0.5, 0.1]
    bench.run(0.5, SetGoal(T))
    past = ticks.take()
    for (_, before), (x, out) in pairwise(past):
        assert np.allclose(x.applied, before.command.qd / 2.0)
        change = np.abs(out.command.qd - x.applied)
        assert (change <= bench.engine.robot.qdd_max * x.dt + 1e-9).all()


def test_a_real_arm_begins_in_hold_and_its_program_waits_for_run(robot, skin, tmp_path):
    from app.control.programs import find_program, load_program

    program = load_program(find_program("door-screws"))
    bench = Bench(robot, skin, begin=Mode.HOLDING, programs={"p": program})
    held = bench.run(4.0, RunProgram("p"))
    assert held.status.mode is Mode.HOLDING and held.program
    assert np.abs(held.joints.q - robot.home).max() < 1e-6
    moved = bench.run(1.0, SetMode(Mode.RUNNING))
    assert np.abs(moved.joints.q - robot.home).max() > 0.01


def test_a_controller_that_is_chosen_does_not_hold_on_to_the_rows_of_another(robot, skin):
    bench = Bench(robot, skin, params=Params(mode="wb"))
    place = beside_the_forearm(robot, bench.run(0.3), 0.17)
    s = bench.run(0.4, AddObstacle("ball", {"kind": "sphere", "radius_m": 0.05}, place))
    assert s.command.control_row >= 0
    by_mode = bench.engine.brain._controllers._by_mode
    bench.run(0.004, SetParams({"mode": "sm"}))
    assert by_mode["wb"] is not by_mode["sm"]


def test_ticks_that_find_no_room_at_a_subscriber_are_counted(robot, skin):
    bench = Bench(robot, skin)
    narrow, wide = bench.engine.subscribe(3), bench.engine.subscribe(100)
    bench.run(0.04)
    assert [x.tick for x, _ in narrow.take()] == [0, 1, 2] and narrow.lost == 7
    assert [x.tick for x, _ in wide.take()] == list(range(10)) and wide.lost == 0
    bench.run(0.004)
    assert [x.tick for x, _ in narrow.take()] == [10]


def test_a_joint_that_is_not_finite_brakes_from_what_was_applied_and_keeps_the_last_place(
    robot, skin
):
    bench = Bench(robot, skin)
    ticks = bench.engine.subscribe(1000)
    T = np.array(bench.run(0.2).T_base_tool)
    T[:3, 3] += [0.0, -0.5, 0.0]
    bench.run(0.4, SetGoal(T))
    x, out = ticks.take()[-1]
    bad = replace(x, joints=replace(x.joints, q=np.full(robot.n, np.nan)), applied=out.command.qd)
    after = bench.engine.brain.tick(bad)
    assert after.status.mode is Mode.STOPPED and "not finite" in after.status.reason
    assert np.abs(after.command.qd).max() < np.abs(out.command.qd).max()
    assert np.allclose(after.T_base_tool, out.T_base_tool)


def test_a_brain_with_no_goal_stays_where_it_first_sees_the_arm(robot, skin):
    brain = Brain(robot, skin)
    _, ticks, _ = recorded(Setup(scene="empty", rate=125.0), 0.1)
    out = [brain.tick(x) for x, _ in ticks][-1]
    assert isinstance(out.goal, Goal)
    assert np.allclose(out.goal.T_base_tool, ticks[0][1].T_base_tool)
