"""mink on given pairs: a frame task, its limits, and one limit with a row for each pair."""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import Any

import numpy as np

from app.config import Params
from app.control.bounds.pairs import gamma
from app.robot.model import Robot

DT = 0.004


def mink_step(robot: Robot, k: int) -> Callable[[Any], bool]:
    """One step: a posture, a goal and the pairs of a case to a joint velocity."""
    mink, limits, mujoco = (import_module(m) for m in ("mink", "mink.limits", "mujoco"))
    params = Params()
    gain = gamma(params)

    class Given(limits.Limit):  # type: ignore[name-defined]
        """-J dq <= gain (d - d_s) dt of the pairs that the step was given."""

        def compute_qp_inequalities(self, configuration: Any, dt: float) -> Any:
            return limits.Constraint(G=-self.J, h=gain * self.h * dt)

    model = mujoco.MjModel.from_xml_string(bare_urdf(robot))
    names = [model.joint(i).name for i in range(model.njnt)]
    speeds = dict(zip(names, robot.qd_max, strict=True))
    keep = Given()
    bounds = [limits.ConfigurationLimit(model), limits.VelocityLimit(model, speeds), keep]
    configuration = mink.Configuration(model, robot.home.copy())
    task = mink.FrameTask(
        frame_name=robot.tool_frame, frame_type="body", position_cost=1.0, orientation_cost=0.5
    )

    def step(c: Any) -> bool:
        configuration.update(np.array(c.posture.q))
        keep.h = c.pairs.distance - params.distance_kept
        keep.J = c.posture.distance_rows(c.pairs.link, c.pairs.on_robot, c.pairs.normal)
        task.set_target(mink.SE3.from_matrix(c.goal.T_base_tool))
        with suppress(mink.NoSolutionFound):  # it has no slack
            mink.solve_ik(configuration, [task], DT, "daqp", limits=bounds)
            return True
        return False

    return step


def bare_urdf(robot: Robot) -> str:
    """The arm's URDF with its frames and joints, without shapes; MuJoCo keeps fixed ones."""
    root = ET.parse(robot.folder / f"{robot.name}.urdf").getroot()
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
        if link.find("inertial") is None:
            inertial = ET.SubElement(link, "inertial")
            ET.SubElement(inertial, "mass", value="0.1")
            ET.SubElement(
                inertial, "inertia", ixx="0.01", iyy="0.01", izz="0.01", ixy="0", ixz="0", iyz="0"
            )
    extra = ET.SubElement(root, "mujoco")
    ET.SubElement(extra, "compiler", fusestatic="false")
    return ET.tostring(root, encoding="unicode")
