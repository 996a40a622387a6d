"""The words of a new robot folder: its two TOML files, with comments for whoever edits them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from app.messages import Array
from app.robot.model import Robot

ROBOT = """\
# What Flinch needs to know of this arm beside its URDF. Every key: robots/README.md
name = {name}
title = {title}   # on the page
urdf = {urdf}
tool_frame = {tool_frame}   # the link whose pose the goal is for; a tool is bolted to it
skin = "skin/rings.toml"   # the layout that is used when none is asked for
# Where the arm begins, degrees (mm for a sliding joint): {joints}
home_deg = {home}
# rad/s^2 (m/s^2 for a sliding joint), a guess: take what the maker or your controller allows.
# Velocity and position limits are the URDF's.
acceleration_limit = {acceleration}
# Links that distances are measured to, if some should be left out; these are all that have a shape:
# links = {links}
# Meshes of the URDF that distances are measured to: collision, or visual where those are hulls.
bodies = {bodies}
# A tool: a name in tools/, the path of its TOML file, or a table [tool] at the end of this file.
# tool = "gripper"
"""
LAYOUT = """\
# Where the sensors sit. After a change: flinch doctor --robot FOLDER
# Every key, and a drawing of axis, start and count: robots/README.md
title = {title}
# type = "vl53l8cx"   # of all sensors: a name in static_assets/sensors, or a file like those

# A printed cover goes round each ring, with a window over every sensor; its bore follows from the
# link's mesh, and all that stands here is its default. Delete it for sensors without covers.
[cover]
# inner_radius_m = 0.05          # of the bore; where the link is not round
# foot_half_width_m = 0.023      # half of its width on the link
# land_half_width_m = 0.012      # half of the flat rim with the windows
# rim_m = 0.002                  # beyond the lenses
# floor_m = 0.001                # of a window, below the lens
# window_half_m = [0.005, 0.004] # of that floor, round the link and along it
"""
RING = """
[[ring]]
name = {name}   # its sensors are {first}, ...
link = {link}
centre_m = {centre}   # in the link's frame
axis = {axis}   # the ring goes round it; images have their upper edge on this side
start = {start}   # from the centre to the first sensor
radius_m = {radius:.4f}   # from the axis to the lenses; the link has {bare:.4f}
count = {count}
{tilt}"""
TILT = "tilt_deg = {tilt:g}   # how far they look towards the axis' direction\n"
SINGLE = """
# A single sensor anywhere:
# [[sensor]]
# name = "ahead"
# link = {link}
# position_m = [0.0, 0.0, 0.1]
# direction = [0.0, 0.0, 1.0]
# up = [1.0, 0.0, 0.0]
"""


class Ring(NamedTuple):
    """A ring as the layout will have it, link frame [m]."""

    name: str
    link: str
    centre: Array
    axis: Array
    start: Array
    radius: float
    sensors: int
    tilt: float = 0.0  # [deg]


def robot_text(robot: Robot, urdf: str, home: Array) -> str:
    """`robot.toml` of a bare URDF's robot that begins at `home` (n,) [rad or m]."""
    values = np.where(robot.slides, 1e3 * home, np.degrees(home))
    return ROBOT.format(
        name=quoted(robot.name),
        title=quoted(robot.title),
        urdf=quoted(urdf),
        tool_frame=quoted(robot.tool_frame),
        joints=", ".join(robot.joints),
        home=numbers(values, 1),
        acceleration=numbers(robot.qdd_max, 1),
        links="[" + ", ".join(map(quoted, robot.links)) + "]",
        bodies=quoted(robot.description.bodies),
    )


def layout_text(rings: Sequence[Ring], lens: float, title: str = "") -> str:
    """The layout with these rings, whose lenses are `lens` [m] above their links."""
    title = title or ", ".join(f"{r.sensors} round {r.link}" for r in rings)
    text = LAYOUT.format(title=quoted(title))
    for r in rings:
        text += RING.format(
            name=quoted(r.name), first=f"{r.name}-01", link=quoted(r.link),
            centre=numbers(r.centre, 4), axis=numbers(r.axis, 6), start=numbers(r.start, 6),
            radius=r.radius, bare=r.radius - lens, count=r.sensors,
            tilt=TILT.format(tilt=r.tilt) if r.tilt else "",
        )  # fmt: skip
    return text + SINGLE.format(link=quoted(rings[-1].link))


def quoted(text: str) -> str:
    """A text as TOML has it."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def numbers(values: Array, digits: int) -> str:
    """A list of numbers as TOML has it, rounded, without minus zero."""
    rounded = (np.round(values, digits) + 0.0).tolist()
    return "[" + ", ".join(map(repr, rounded)) + "]"
