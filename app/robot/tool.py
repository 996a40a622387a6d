"""A tool: what is bolted to the flange, as a body of its own with the tool frame at its tip."""

from math import radians
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from app.errors import RobotError
from app.robot.bolted import bolt, read_solid
from app.robot.tables import ToolTable
from app.robot.urdf import add_link
from app.toml import read_toml


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
    body, visual = folder / tool.body, folder / (tool.visual or tool.body)
    solid = read_solid(body, "the tool's mesh")
    tensor = np.asarray(solid.moment_inertia) * (tool.mass_kg / solid.volume)
    centre = np.array(tool.centre_of_mass_m)
    bolt(root, tool.name, flange, body, visual, tool.mass_kg, centre, tensor)
    tip = f"{tool.name}_tip"
    turn = np.array([radians(v) for v in tool.rpy_deg])
    add_link(root, tip, tool.name, (np.array(tool.position_m), turn))
    return tip
