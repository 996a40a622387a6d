"""roboplan's OInK on given pairs: a small sphere at each end of each pair.

Its barriers find their distances themselves, so the arm is given without shapes and each pair
as two spheres, which is the least that it can measure: one on the link and one in the world.
"""

from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import Any

import numpy as np

from app.bench.peers.mink import bare_urdf
from app.config import Params
from app.control.bounds.pairs import gamma
from app.robot.model import Robot

DT, RADIUS = 0.004, 1e-3  # [s], [m]


def roboplan_step(robot: Robot, k: int) -> Callable[[Any], bool]:
    """One step: a posture, a goal and the pairs of a case to a joint displacement."""
    core, ik = import_module("roboplan.core"), import_module("roboplan.optimal_ik")
    params = Params()
    scene = core.Scene("arm", core.loadUrdfSceneDescriptionFromXml(bare_urdf(robot)))
    here, grey = np.asfortranarray(np.eye(4)), np.full(4, 0.5)
    ends = [(f"on_{i}", f"at_{i}") for i in range(k)]
    for on, at in ends:
        scene.addSphereGeometry(on, robot.links[-1], core.Sphere(RADIUS), here, grey)
        scene.addSphereGeometry(at, "universe", core.Sphere(RADIUS), here, grey)
    names = [name for pair in ends for name in pair]
    scene.setCollisions([(a, b) for a in names for b in names if a < b], False)
    scene.setCollisions(ends, True)
    oink = ik.Oink(scene)
    target = core.CartesianConfiguration()
    target.base_frame, target.tip_frame, target.tform = robot.links[0], robot.tool_frame, here
    task = ik.FrameTask(oink, scene, target, ik.FrameTaskOptions(orientation_cost=0.5))
    limits = [ik.PositionLimit(oink), ik.VelocityLimit(oink, DT, robot.qd_max)]
    gain = gamma(params)
    options = ik.SelfCollisionBarrierOptions(
        n_collision_pairs=k, gain=gain, d_min=params.distance_kept
    )
    barrier = ik.SelfCollisionBarrier(oink, scene, DT, options)
    out = np.zeros(robot.n)

    def place(name: str, frame: str, point: Any) -> None:
        T = np.asfortranarray(np.eye(4))
        T[:3, 3] = point
        scene.updateGeometryPlacement(name, frame, T)

    def step(c: Any) -> bool:
        for i, (on, at) in enumerate(ends):
            link = c.pairs.link[i]
            T = c.posture.T_base_link[link]
            place(on, robot.links[link], T[:3, :3].T @ (c.pairs.on_robot[i] - T[:3, 3]))
            place(at, "universe", c.pairs.on_world[i])
        task.setTargetFrameTransform(np.asfortranarray(c.goal.T_base_tool))
        with suppress(RuntimeError):  # it has no slack
            oink.solveIk(np.array(c.posture.q), [task], limits, [barrier], out)
            return True
        return False

    return step
