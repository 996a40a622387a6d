"""A part that is bolted to a link: a tool, or the covers of a skin.

It becomes a link of its own in the URDF, so that self filter, closest pairs and the page know it
like any other.
"""

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from app.errors import RobotError
from app.messages import Array
from app.robot.urdf import add_link, numbers
from app.surface import check_surface, read_surfaces


def read_solid(file: Path, what: str) -> Any:
    """The closed mesh in a file as a trimesh; `what` it is, and the key that names it."""
    if not file.is_file():
        raise RobotError(f"{file}: {what} is missing; put the file there or mend its path")
    mesh: Any = read_surfaces(file, RobotError).to_mesh()
    check_surface(np.asarray(mesh.vertices), np.asarray(mesh.faces), f"{file}: {what}", RobotError)
    if not mesh.is_volume:
        raise RobotError(f"{file}: {what} is not closed; export it as one solid")
    return mesh


def bolt(
    root: Element,
    name: str,
    parent: str,
    body: Path,
    visual: Path,
    mass: float,
    centre: Array,
    tensor: Array,
) -> None:
    """Add a link `name` in the frame of `parent`, with mesh files of what is measured and shown.

    mass: [kg].   centre: (3,) [m] of mass.   tensor: (3, 3) [kg m^2] about it.
    """
    inertial, shown, measured = Element("inertial"), Element("visual"), Element("collision")
    SubElement(inertial, "origin", xyz=numbers(centre), rpy="0 0 0")
    SubElement(inertial, "mass", value=repr(float(mass)))
    upper = {f"i{'xyz'[i]}{'xyz'[j]}": tensor[i, j] for i in range(3) for j in range(i, 3)}
    SubElement(inertial, "inertia", {key: repr(float(value)) for key, value in upper.items()})
    for element, file in ((shown, visual), (measured, body)):
        geometry = SubElement(element, "geometry")
        SubElement(geometry, "mesh", filename=str(file.resolve()))
    add_link(root, name, parent, (np.zeros(3), np.zeros(3)), (inertial, shown, measured))
