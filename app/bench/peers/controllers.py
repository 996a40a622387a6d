"""Other controllers on the same pairs, where their packages can be imported.

They are given what our own are given: joint positions, a goal, and for each pair its distance
and the row of its jacobian. Everyone finds the arm's kinematics inside of the clock, and solves
with the fastest solver that it can be given: pink and mink with daqp, as we do (pink with proxqp
takes longer).
"""

from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from app.bench.peers.mink import mink_step
from app.bench.peers.neo import neo_step
from app.bench.peers.roboplan import roboplan_step
from app.config import Params
from app.control.bounds.pairs import gamma
from app.robot.model import Robot

Step = Callable[[Any], bool]  # was there an answer?
DT = 0.004


def available_peers() -> dict[str, Callable[[Robot, int], Step] | str]:
    """By name: what makes a step of the peer, or why there is none."""
    known: dict[str, tuple[str, Callable[[Robot, int], Step] | str]] = {
        "pink": ("pink", _pink),
        "mink": ("mink", mink_step),
        "NEO with quadprog": ("quadprog", neo_step),
        "roboplan": ("roboplan", roboplan_step),
    }
    return {
        name: make if find_spec(module) else f"package {module} is not installed"
        for name, (module, make) in known.items()
    }


def _pink(robot: Robot, k: int) -> Step:
    """pink: a frame task, its velocity and position limits, and one barrier with k rows."""
    pink, barriers = import_module("pink"), import_module("pink.barriers")
    limits, tasks = import_module("pink.limits"), import_module("pink.tasks")
    params = Params()

    class Given(barriers.Barrier):  # type: ignore[name-defined]
        """h = d - d_s of the pairs that the step was given."""

        def compute_barrier(self, configuration: Any) -> Any:
            return self.h

        def compute_jacobian(self, configuration: Any) -> Any:
            return self.J

    model = robot._model
    keep = Given(k, gain=gamma(params))
    task = tasks.FrameTask(robot.tool_frame, position_cost=1.0, orientation_cost=0.5)
    bounds = (limits.ConfigurationLimit(model), limits.VelocityLimit(model))
    configuration = pink.Configuration(model, model.createData(), robot.home.copy())
    target = configuration.get_transform_frame_to_world(robot.tool_frame).copy()

    def step(c: Any) -> bool:
        configuration.update(np.array(c.posture.q))
        keep.h = c.pairs.distance - params.distance_kept
        keep.J = c.posture.distance_rows(c.pairs.link, c.pairs.on_robot, c.pairs.normal)
        target.translation = c.goal.T_base_tool[:3, 3]
        target.rotation = c.goal.T_base_tool[:3, :3]
        task.set_target(target)
        with suppress(pink.exceptions.NoSolutionFound):  # it has no slack
            pink.solve_ik(
                configuration, [task], DT, solver="daqp", limits=bounds, barriers=[keep],
                safety_break=False,
            )  # fmt: skip
            return True
        return False

    return step
