"""Every kernel called once, in every way, before an arm may move: nothing compiles later."""

from dataclasses import replace
from typing import get_args

import numpy as np

from app.brain import Brain
from app.cell.parts import Cell
from app.config import ControlMode, Params
from app.messages import SLOTS, JointState, SensorFrame, freeze
from app.robot.model import Robot
from app.robot.skin import Skin
from app.tick import ArmReport, Inputs, SourceReport


def rehearse(robot: Robot, skin: Skin, cell: Cell, params: Params) -> None:
    """Tick a brain of its own once in every way.

    Seconds on the very first start, a moment once the kernels' cache on disk is filled.
    """
    still = freeze(np.zeros(robot.n))  # as an arm's state is
    full = (np.full(SLOTS, 5, dtype=np.uint8), np.ones(SLOTS, dtype=np.uint8))
    everybody = SourceReport(np.ones(skin.count, dtype=bool))
    brain = Brain(robot, skin, cell, params)
    stamp = 0.0
    for mode in get_args(ControlMode):
        for memory in (False, True):
            brain.wishes.params = replace(params, mode=mode, memory=memory, many_pairs=memory)
            for depth, later in ((0.3, 0.1), (0.31, 0.1), (0.31, 0.004)):  # the last holds pairs
                stamp += later
                frames = tuple(
                    SensorFrame(k, stamp, 0, np.full(SLOTS, depth), *full)
                    for k in range(skin.count)
                )
                joints = JointState(stamp, robot.home, still)
                brain.tick(
                    Inputs(0, stamp, 0.004, 0.0, joints, still, ArmReport(), frames, everybody)
                )
    brain._perception._memory.mark_moving(np.zeros((1, 3)), stamp)  # here nothing has moved
