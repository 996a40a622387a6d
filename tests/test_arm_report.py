"""What an arm says of itself stops the engine, or makes it wait, or is only shown."""

import numpy as np
import pytest

from app.actions import SetGoal, SetMode
from app.messages import Mode
from app.robot.arm import SimulatedArm
from app.sensing.error_model import ErrorModel
from app.sensing.simulated import SimulatedSkin
from app.tick import ArmReport
from app.timing import ManualClock
from app.wiring import assemble
from app.world.world import World


class TalkingArm(SimulatedArm):
    """A simulated arm that says what it is told to, and counts what is asked of it."""

    said = ArmReport()
    engaged = closed = 0

    def report(self, now):
        return self.said

    def engage(self):
        self.engaged += 1

    def close(self):
        self.closed += 1


@pytest.fixture
def arm(robot):
    return TalkingArm(robot)


@pytest.fixture
def engine(robot, skin, arm):
    world = World(())
    eye = SimulatedSkin(robot, skin, world, 0, ErrorModel(ideal=True))
    return assemble(robot, skin, arm, eye, world, ManualClock())


def run(engine, seconds, *actions):
    for action in actions:
        engine.post(action)
    for _ in range(round(250 * seconds)):
        snapshot = engine.step()
    return snapshot


def on_the_way(engine):
    T = np.array(run(engine, 0.2).T_base_tool)
    T[2, 3] += 0.3
    return run(engine, 0.5, SetGoal(T))


def test_a_fault_of_the_arm_stops_it_in_its_words_until_a_person_acts(engine, arm):
    assert on_the_way(engine).joints.qd.any()
    arm.said = ArmReport(fault="the link is lost", ready=False)
    stopped = run(engine, 0.5)
    assert (stopped.status.mode, stopped.status.reason) == (Mode.STOPPED, "the link is lost")
    assert np.abs(stopped.joints.qd).max() < 1e-3
    arm.said = ArmReport()
    assert run(engine, 0.5).status.mode is Mode.STOPPED
    assert run(engine, 0.5, SetMode(Mode.RUNNING)).joints.qd.any()


def test_an_arm_that_is_not_ready_is_asked_to_stand_and_goes_on_by_itself(engine, arm):
    on_the_way(engine)
    arm.said = ArmReport(advice="it wakes up", ready=False)
    waits = run(engine, 0.5)
    assert waits.status.mode is Mode.RUNNING and waits.advice == "it wakes up"
    assert not np.abs(waits.command.qd).max() > 1e-6
    arm.said = ArmReport()
    assert np.abs(run(engine, 0.5).command.qd).max() > 0.01


def test_advice_alone_is_shown_and_the_controller_goes_on(engine, arm):
    arm.said = ArmReport(advice="only watched")
    seen = on_the_way(engine)
    assert seen.advice == "only watched" and np.abs(seen.command.qd).max() > 0.01


def test_only_a_person_engages_the_arm(engine, arm):
    on_the_way(engine)
    run(engine, 0.1, SetMode(Mode.STOPPED))
    assert arm.engaged == 0
    run(engine, 0.1, SetMode(Mode.RUNNING))
    run(engine, 0.1, SetMode(Mode.HOLDING))
    assert arm.engaged == 2


def test_the_arm_is_left_when_the_engine_ends(engine, arm):
    engine.start()
    engine.close()
    assert arm.closed == 1
