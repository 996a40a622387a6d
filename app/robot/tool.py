"""A tool: what is bolted to the flange, as a body of its own with the tool frame at its tip."""

from math import radians
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import trimesh

from app.errors import RobotError
from app.robot.tables import ToolTable
from app.robot.urdf import add_link, numbers
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
    inertial, visual, collision = Element("inertial"), Element("visual"), Element("collision")
    SubElement(inertial, "origin", xyz=numbers(np.array(tool.centre_of_mass_m)), rpy="0 0 0")
    SubElement(inertial, "mass", value=repr(tool.mass_kg))
    tensor = _inertia(folder / tool.body, tool.mass_kg)
    upper = {f"i{'xyz'[i]}{'xyz'[j]}": tensor[i, j] for i in range(3) for j in range(i, 3)}
    SubElement(inertial, "inertia", {key: repr(float(value)) for key, value in upper.items()})
    for element, file in ((visual, tool.visual or tool.body), (collision, tool.body)):
        geometry = SubElement(element, "geometry")
        SubElement(geometry, "mesh", filename=str((folder / file).resolve()))
    here = (np.zeros(3), np.zeros(3))
    add_link(root, tool.name, flange, here, (inertial, visual, collision))
    tip = f"{tool.name}_tip"
    turn = np.array([radians(v) for v in tool.rpy_deg])
    add_link(root, tip, tool.name, (np.array(tool.position_m), turn))
    return tip


def _inertia(file: Path, mass: float) -> np.ndarray:
    """(3, 3) [kg m^2] about the centre of the evenly filled mesh."""
    if not file.is_file():
        raise RobotError(f"{file}: the tool's mesh is missing; put the file there or mend `body`")
    mesh: Any = trimesh.load(file, force="mesh")
    if not mesh.is_volume:
        raise RobotError(f"{file}: the tool's body is not closed; export it as one solid")
    return np.asarray(mesh.moment_inertia) * (mass / mesh.volume)
