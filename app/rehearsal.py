"""Every kernel called once, in every way, before an arm may move: nothing compiles later.

A kernel has one version (`app.compiled`), so it is enough that each is called. A brain of its
own is run in every mode with every switch turned, before something near and with pairs held.
"""

from dataclasses import replace

import numpy as np

from app.brain import Brain
from app.cell.parts import Cell
from app.compiled import Progress, told
from app.config import MODES, Params, change, tunables
from app.control.controller import Situation
from app.control.manipulability import _gradient
from app.control.unseen import Unseen
from app.messages import Command, Goal, JointState, Pairs, SensorFrame, freeze
from app.perception.perception import Perception
from app.robot.model import Robot
from app.robot.sensor_type import SensorType
from app.robot.skin import Skin
from app.tick import ArmReport, Inputs, SourceReport

# what is turned in every mode: each switch, and each setting with a choice but the mode itself
CHOICES = {t.name: t.choices for t in tunables() if t.kind is bool or t.choices}
SWITCHES = tuple(name for name in CHOICES if name != "mode")
STEPS = ((0.3, 0.1), (0.31, 0.1), (0.31, 0.004))  # [m] all zones, [s] later; the last holds pairs


def silent(number: int, of: int, name: str) -> None:
    """Nobody wants to know."""


def rehearse(
    robot: Robot, skin: Skin, cell: Cell, params: Params, progress: Progress = silent
) -> None:
    """Tick a brain of its own in every way.

    A minute on the very first start, with `progress` told of each kernel that is compiled; a
    second once they are kept on disk.
    """
    with told(progress):
        perception = Perception(robot, skin, cell)  # its parts have to be called as well
        brain = Brain(robot, skin, cell, params, goal=_aside(robot), perception=perception)
        stamp = 0.0
        for mode in tuple(MODES):
            for name in ("mode", *SWITCHES):
                now = replace(params, mode=mode)
                if name != "mode":
                    now = turned(now, name)
                brain.wishes.params = now
                for depth, later in STEPS:
                    stamp += later
                    out = brain.tick(_inputs(robot, skin, stamp, depth))
                    if out.trace:
                        raise RuntimeError(f"rehearsing {mode} with {name} turned\n{out.trace}")
        brain.wishes.params = params
        for later in (0.1, 0.2):  # two frames, or a lone zone's return is not believed
            brain.tick(_inputs(robot, skin, stamp + later, 0.3, lone=True))
        _seldom(brain, perception, stamp)


def turned(params: Params, name: str) -> Params:
    """The settings with a switch turned, or the other choice taken."""
    value, choices = getattr(params, name), CHOICES[name]
    return change(params, {name: next(c for c in choices if c != value) if choices else not value})


def _aside(robot: Robot) -> Goal:
    """A goal that the arm is not at."""
    T = robot.posture(robot.home).T_base_tool.copy()
    T[:3, 3] += 0.1
    return Goal(freeze(T))


def _inputs(robot: Robot, skin: Skin, stamp: float, depth: float, lone: bool = False) -> Inputs:
    """Every sensor has just seen something at `depth` [m], in all of its zones or a lone one."""
    still = freeze(np.zeros(robot.n))
    frames = tuple(
        _frame(k, sensor.type, stamp, depth, lone) for k, sensor in enumerate(skin.sensors)
    )
    joints = JointState(stamp, freeze(robot.home.copy()), still)
    everybody = SourceReport(np.ones(skin.count, dtype=bool))
    return Inputs(0, stamp, 0.004, 0.0, joints, still, ArmReport(), frames, everybody)


def _frame(k: int, kind: SensorType, stamp: float, depth: float, lone: bool) -> SensorFrame:
    """A frame in which every zone, or the first alone, sees something at `depth` [m]."""
    status, targets = np.full((2, kind.zones), 1, dtype=np.uint8)
    targets[1:] = 0 if lone else 1
    return SensorFrame(
        k, stamp, 0, np.full(kind.zones, depth), status * np.uint8(kind.status.valid), targets
    )


def _seldom(brain: Brain, perception: Perception, stamp: float) -> None:
    """What only happens when something moves, an arm is stretched, sensors cannot tell, or a tick
    fails."""
    perception._memory.mark_moving(np.zeros((1, 3)), stamp)
    robot = brain.robot
    nothing, none = np.empty((0, 3)), np.empty(0, dtype=np.int64)
    nothing_near = Pairs(none, np.empty(0), nothing, nothing, nothing, none, closest=-1)
    everything = Unseen(*brain._guard._cones.everything)
    still = Situation(
        robot.posture(robot.home), JointState(stamp, robot.home, np.zeros(robot.n)),
        nothing_near, None, brain.params, 0.004, 1.0, np.zeros(robot.n),
    )  # fmt: skip
    if robot.n == 6:  # of another arm there is no gradient
        _gradient(still.posture.J_base, np.eye(6), 1.0, np.zeros(6))
    brain._controllers._unseen.slowed(Command(qd=np.ones(robot.n)), still, everything)
    nowhere = JointState(stamp, np.full(robot.n, np.nan), np.zeros(robot.n))
    brain.tick(replace(_inputs(robot, brain.skin, stamp, 0.3), joints=nowhere, frames=()))
