"""A URDF's text, mended before anyone reads it, so that kinematics and meshes read the same.

- A continuous joint becomes a revolute one of two turns either way: the program works with
  position limits, and two turns are more than a cable bears.
- A joint without a usable velocity limit gets `SPEED`, and the log says so.
- Attributes and elements of other namespaces are left out, declared or not, as urdfdom does.
- A tool is added as a link of its own, fixed to the link that it is bolted to, with its tip as
  another link: self filter, closest pairs and the page then know it like any other link.
"""

import logging
import re
from math import pi
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from app.errors import RobotError
from app.messages import Array
from app.text_file import read_file

log = logging.getLogger(__name__)
SPEED = 1.0  # [rad/s or m/s] of a joint whose URDF gives none
TURNS = 2 * pi  # [rad] limit of a continuous joint, either way
ROOT = re.compile(rb"<(?:[\w.-]+:)?robot\b")
DECLARED = re.compile(rb"\bxmlns:([\w.-]+)\s*=")
PREFIX = re.compile(rb"[<\s/]([A-Za-z_][\w.-]*):[A-Za-z_][\w.-]*(?=\s*[=\s/>])")
MOVING = ("revolute", "continuous", "prismatic")


def read_urdf(path: Path) -> Element:
    """The mended <robot> of a URDF file; raises `RobotError` when it is not one."""
    try:
        root = _parsed(read_file(path, RobotError))
    except (ElementTree.ParseError, ValueError, LookupError) as e:
        raise RobotError(f"{path}: not a readable URDF ({e}); mend it") from e
    own = _namespace(root.tag)
    root.tag = root.tag.removeprefix(own)
    if root.tag != "robot":
        raise RobotError(f"{path}: not a readable URDF (it is a <{root.tag}>); give a <robot>")
    if any("xacro" in e.tag for e in root.iter() if isinstance(e.tag, str)):
        raise RobotError(f"{path}: has xacro macros; expand them first: xacro FILE > robot.urdf")
    _leave_out_foreign(root, own)
    for joint in root.findall("joint"):
        if joint.get("type") in MOVING:
            _bound(joint, path)
    for link in root.findall("link"):
        inertial = link.find("inertial")
        if inertial is not None and (
            inertial.find("mass") is None or inertial.find("inertia") is None
        ):
            link.remove(inertial)  # half of one is none, to urdfdom as well
    return root


def _parsed(content: bytes) -> Element:
    """The root of an XML text; prefixes that nobody has declared are declared, as if they were, for
    other readers of URDF do not ask for it."""
    try:
        return ElementTree.fromstring(content)
    except ElementTree.ParseError as e:
        if "unbound prefix" not in str(e):
            raise
    start = ROOT.search(content)
    if start is None:
        return ElementTree.fromstring(content)
    declared = set(DECLARED.findall(content)) | {b"xml", b"xmlns"}
    names = sorted(set(PREFIX.findall(content)) - declared)
    more = b"".join(b' xmlns:%s="urn:%s"' % (name, name) for name in names)
    return ElementTree.fromstring(content[: start.end()] + more + content[start.end() :])


def _namespace(tag: str) -> str:
    """What stands before a tag's name."""
    return tag[: tag.index("}") + 1] if tag.startswith("{") else ""


def _leave_out_foreign(parent: Element, own: str) -> None:
    """Take out elements and attributes of other namespaces than the root's `own`, which stands for
    none: they mean something to another program."""
    for key in [k for k in parent.attrib if k.startswith("{")]:
        del parent.attrib[key]
    for child in list(parent):
        if not isinstance(child.tag, str) or _namespace(child.tag) not in ("", own):
            parent.remove(child)
            continue
        child.tag = child.tag.removeprefix(own)
        _leave_out_foreign(child, own)


def to_text(root: Element) -> str:
    """The URDF as XML."""
    return ElementTree.tostring(root, encoding="unicode")


def link_names(root: Element) -> list[str]:
    """Every link, in the file's order."""
    return [e.get("name", "") for e in root.findall("link")]


def last_link(root: Element) -> str:
    """The end of the chain with most moving joints, then most links; the first of equals."""
    parents = {}
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        if parent is not None and child is not None:
            moves = joint.get("type") in MOVING
            parents[child.get("link", "")] = (parent.get("link", ""), moves)

    def length(link: str) -> tuple[int, int]:
        moving, links = 0, 0
        while link in parents and links <= len(parents):  # a ring is pinocchio's to refuse
            link, moves = parents[link]
            moving, links = moving + moves, links + 1
        return moving, links

    return max(link_names(root), key=length, default="")


def add_link(
    root: Element,
    name: str,
    parent: str,
    T_parent_link: tuple[Array, Array],
    inside: tuple[Element, ...] = (),
) -> None:
    """A link fixed to `parent` at (position (3,) [m], rpy (3,) [rad]); `inside` is its content."""
    if name in link_names(root):
        raise RobotError(f"the robot has a link {name!r} already; give the new part another name")
    SubElement(root, "link", name=name).extend(inside)
    joint = SubElement(root, "joint", name=f"{parent}-{name}", type="fixed")
    SubElement(joint, "parent", link=parent)
    SubElement(joint, "child", link=name)
    xyz, rpy = T_parent_link
    SubElement(joint, "origin", xyz=numbers(xyz), rpy=numbers(rpy))


def numbers(values: Array) -> str:
    """As a URDF writes a vector."""
    return " ".join(repr(float(v)) for v in values)


def _bound(joint: Element, path: Path) -> None:
    limit = joint.find("limit")
    if limit is None:
        limit = SubElement(joint, "limit")
    if joint.get("type") == "continuous":
        joint.set("type", "revolute")
        limit.set("lower", repr(-TURNS))
        limit.set("upper", repr(TURNS))
    limit.set("effort", limit.get("effort", "0"))
    try:
        speed = float(limit.get("velocity", "0"))
    except ValueError:
        speed = 0.0
    if not 0.0 < speed < 1e3:
        log.warning(
            "%s: joint %s has no usable velocity limit; %g a second is assumed",
            path.name, joint.get("name"), SPEED,
        )  # fmt: skip
        limit.set("velocity", repr(SPEED))
