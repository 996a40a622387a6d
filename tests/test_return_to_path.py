"""What a program's arm does once it has given way: it comes back to its line and goes on."""

import numpy as np
import pytest

from app.config import Params
from app.control.programs import Program, ProgramRun, Waypoint
from app.messages import Pairs
from app.robot.arm import SimulatedArm
from tests.alone import alone

DT = 0.01
CAME, LEFT = 1.5, 3.0  # [s] a hand beside the tool
WAY = np.array([0.0, 0.35, 0.0])  # [m]


def hand(T_base_tool, there):
    """A point 12 cm under the tool, or nothing."""
    n = np.array([[0.0, 0.0, 1.0]])[: int(there)]
    k = len(n)
    on = np.repeat(T_base_tool[None, :3, 3], k, axis=0)
    d = np.full(k, 0.12)
    return Pairs(np.full(k, 6), d, on, on - d[:, None] * n, n, np.arange(k), k - 1)


@pytest.mark.parametrize("kind", ["wb", "qp"])
def test_the_tool_returns_to_its_line_after_it_gave_way_and_reaches_the_waypoint(robot, kind):
    control = alone(robot, kind)
    params = Params(mode=kind)
    start = robot.posture(robot.home).T_base_tool
    end = np.array(start)
    end[:3, 3] += WAY
    program = Program("line", "", (Waypoint("end", end, 0.0),), 0.01, 0.1, 0.06, 0.5, False)
    run, arm = ProgramRun(program, start), SimulatedArm(robot)
    aside, at = [], []
    for i in range(int(20.0 / DT)):
        state = arm.state(i * DT)
        posture = robot.posture(state.q)
        off = posture.T_base_tool[:3, 3] - start[:3, 3]
        along = WAY / np.linalg.norm(WAY)
        aside.append(float(np.linalg.norm(off - (off @ along) * along)))
        at.append(i * DT)
        if run.done:
            break
        goal = run.update(posture.T_base_tool, DT)
        pairs = hand(posture.T_base_tool, CAME <= i * DT < LEFT)
        arm.send(control.update(posture, state, pairs, goal, params, DT).qd, DT)
    off_line, t = np.array(aside), np.array(at)
    assert run.done and run.reached == 1
    assert off_line[t < CAME].max() < 0.005
    assert off_line.max() > 0.03  # it did give way
    back = t[np.flatnonzero(off_line > 0.01)[-1]]
    assert back < t[-1] - 0.5 and back < LEFT + 4.0  # and was back well before the end
