"""Names into facts: the robot, its skin and the posture to begin in."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from app.errors import ConfigError, RobotError
from app.messages import Array, freeze
from app.robot.descriptions import PREFIX, find_description
from app.robot.model import Robot, find_robot, load_robot, load_urdf
from app.robot.mounts import load_mounts, with_mounts
from app.robot.ranges import complete, load_ranges
from app.robot.skin import Skin
from app.robot.skin_file import load_skin
from app.sensing.latency import with_stamp_doubt
from app.sensing.port_spec import parse_ports
from app.sensing.replays import captured_ports
from app.setup import Setup
from app.tick import Limits
from app.world.scene import Scene


def limited(robot: Robot, limits: Limits) -> Robot:
    """The robot as its arm lets it move: the controller plans with these velocities."""
    return replace(
        robot,
        qd_max=freeze(np.minimum(robot.qd_max, limits.qd_max)),
        qdd_max=freeze(np.minimum(robot.qdd_max, limits.qdd_max)),
    )


def choose_home(setup: Setup, scene: Scene, robot: Robot) -> Array | None:
    """The posture to begin in; None for the robot's own."""
    home = scene.home
    if setup.choice.home_deg or scene.robot not in ("", robot.name):
        return None  # a posture of another robot means nothing here; its own does
    if home is not None and len(home) != robot.n:
        raise ConfigError(
            f"scene {setup.scene!r}: home_deg has {len(home)} values, {robot.name} has "
            f"{robot.n} joints; choose a scene made for this robot, or give the posture with "
            "--home-deg"
        )
    return home


def build_robot(setup: Setup) -> Robot:
    """The robot that a setup names, in the covers of its layout: a folder, a bare URDF, or a
    public description."""
    choice = replace(setup.choice, skin=setup.skin)
    if setup.urdf:
        return load_urdf(Path(setup.urdf), choice)
    if setup.robot.startswith(PREFIX):
        return load_urdf(find_description(setup.robot.removeprefix(PREFIX)), choice)
    return load_robot(find_robot(setup.robot), choice)


def choose_skin(setup: Setup, robot: Robot) -> Skin:
    """What is believed of the layout whose covers the robot wears, as `build_robot` chose it."""
    skin = lay_out(robot)
    kind, _, ports = setup.sensors.partition("+simulated")[0].partition(":")
    if kind == "serial" and ports:
        skin = with_stamp_doubt(skin, parse_ports(ports, skin))
    elif kind == "replay":
        skin = with_stamp_doubt(skin, captured_ports(ports, skin))
    if setup.ranges is not None:
        skin = replace(skin, ranges=complete(load_ranges(setup.ranges, skin.slots)))
    return with_mounts(skin, load_mounts(setup.mounts), robot) if setup.mounts else skin


def lay_out(robot: Robot) -> Skin:
    """The skin exactly as the layout says whose covers the robot wears."""
    if robot.layout is None:
        raise RobotError(f"{robot.name} names no skin of its own; choose a layout with --skin")
    return load_skin(robot.layout, robot)


def build_robot_and_skin(setup: Setup) -> tuple[Robot, Skin]:
    """Both; RobotError where neither the setup nor the robot names a layout."""
    robot = build_robot(setup)
    return robot, choose_skin(setup, robot)
