"""A tool: what is bolted to the flange, as a body of its own with the tool frame at its tip."""

from math import radians
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
import trimesh

from app.errors import RobotError
from app.robot.bolted import BodyShape, bolt, mesh_shape, read_solid
from app.robot.tables import ToolTable
from app.robot.urdf import add_link
from app.toml import Vector, read_toml

SHAPES = ("body", "box_m", "cylinder_m", "sphere_m")


def read_tool(path: Path) -> ToolTable:
    """A tool's own file."""
    return read_toml(path, ToolTable, RobotError)


def find_tool(name: str, folder: Path) -> Path | None:
    """The file of a tool by path, or by name in `folder/tools`; None if there is none."""
    candidates = (Path(name), folder / name, folder / "tools" / f"{name}.toml")
    return next((p for p in candidates if p.suffix == ".toml" and p.is_file()), None)


def tool_names(folder: Path) -> list[str]:
    """The tools that a robot's folder holds."""
    return sorted(p.stem for p in (folder / "tools").glob("*.toml"))


def mount(root: Element, tool: ToolTable, folder: Path, flange: str) -> str:
    """Add the tool to a URDF, its mesh files beside `folder`; returns the name of its tip."""
    solid, body, middle = _body(tool, folder)
    tensor = np.asarray(solid.moment_inertia) * (tool.mass_kg / solid.volume)
    centre = np.array(middle if tool.centre_of_mass_m is None else tool.centre_of_mass_m)
    visual = body if tool.visual is None else mesh_shape(folder / tool.visual)
    bolt(root, tool.name, flange, (body, visual), (tool.mass_kg, centre, tensor))
    tip = f"{tool.name}_tip"
    turn = np.array([radians(v) for v in tool.rpy_deg])
    add_link(root, tip, tool.name, (np.array(tool.position_m), turn))
    return tip


def _body(tool: ToolTable, folder: Path) -> tuple[Any, BodyShape, Vector | None]:
    """The tool's solid, what the URDF says of it, and the middle of a simple shape."""
    given = [k for k in SHAPES if getattr(tool, k) is not None]
    if len(given) != 1:
        what = "has " + (" and ".join(given) if given else "no body")
        raise RobotError(f"tool {tool.name!r} {what}; give one of {', '.join(SHAPES)}")
    if tool.body is not None:
        if tool.centre_m is not None or tool.centre_of_mass_m is None:
            key = "centre_m" if tool.centre_m is not None else "centre_of_mass_m"
            remedy = "leave it out" if key == "centre_m" else "give it"
            raise RobotError(f"tool {tool.name!r}: {key} does not fit a mesh; {remedy}")
        file = folder / tool.body
        return read_solid(file, "the tool's mesh"), mesh_shape(file), None
    solid, shape, height = _simple(tool)
    middle = (0.0, 0.0, height / 2.0) if tool.centre_m is None else tool.centre_m
    return solid, shape._replace(at=np.array(middle)), middle


def _simple(tool: ToolTable) -> tuple[Any, BodyShape, float]:
    """A box, a cylinder or a ball: its solid, the URDF's words, and its height [m]."""
    if tool.box_m is not None:
        x, y, z = tool.box_m
        solid = trimesh.creation.box((x, y, z))
        return solid, BodyShape("box", {"size": f"{x!r} {y!r} {z!r}"}), z
    if tool.cylinder_m is not None:
        r, length = tool.cylinder_m
        solid = trimesh.creation.cylinder(radius=r, height=length)
        return solid, BodyShape("cylinder", {"radius": repr(r), "length": repr(length)}), length
    r = tool.sphere_m or 0.0
    return trimesh.creation.icosphere(radius=r), BodyShape("sphere", {"radius": repr(r)}), 2.0 * r
