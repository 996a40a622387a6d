"""A part that is bolted to a link: a tool, or the covers of a skin.

It becomes a link of its own in the URDF, so that self filter, closest pairs and the page know it
like any other.
"""

from pathlib import Path
from typing import Any, NamedTuple
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


class BodyShape(NamedTuple):
    """A geometry as a URDF says it: its tag, its attributes, and where it is (3,) [m]."""

    tag: str
    attributes: dict[str, str]
    at: Array | None = None


def mesh_shape(file: Path) -> BodyShape:
    """The mesh of a file."""
    return BodyShape("mesh", {"filename": str(file.resolve())})


def bolt(
    root: Element,
    name: str,
    parent: str,
    shapes: tuple[BodyShape, BodyShape],
    inertia: tuple[float, Array, Array],
) -> None:
    """Add a link `name` in the frame of `parent`, with shapes of what is measured and shown.

    inertia: mass [kg], its centre (3,) [m], and the tensor (3, 3) [kg m^2] about it.
    """
    mass, centre, tensor = inertia
    body, visual = shapes
    inertial, shown, measured = Element("inertial"), Element("visual"), Element("collision")
    SubElement(inertial, "origin", xyz=numbers(centre), rpy="0 0 0")
    SubElement(inertial, "mass", value=repr(float(mass)))
    upper = {f"i{'xyz'[i]}{'xyz'[j]}": tensor[i, j] for i in range(3) for j in range(i, 3)}
    SubElement(inertial, "inertia", {key: repr(float(value)) for key, value in upper.items()})
    for element, shape in ((shown, visual), (measured, body)):
        if shape.at is not None:
            SubElement(element, "origin", xyz=numbers(shape.at), rpy="0 0 0")
        SubElement(SubElement(element, "geometry"), shape.tag, shape.attributes)
    add_link(root, name, parent, (np.zeros(3), np.zeros(3)), (inertial, shown, measured))
