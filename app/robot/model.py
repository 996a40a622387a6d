"""A robot: description, limits, bodies and what it is called; from a folder or a bare URDF.

`robot.toml` names the URDF and the facts that a URDF cannot hold; a bare URDF gets defaults.
Kinematics come from pinocchio, meshes from the URDF's `visual` and `collision` entries. The
base frame is the URDF's root link. A missing mesh is an error.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from app.assets import asset_folder, find_asset
from app.errors import RobotError, options
from app.messages import Array, freeze
from app.raycast import RigidMesh
from app.robot.covers import cover_name, mount_covers
from app.robot.gears import Gears, read_gears
from app.robot.kinematics import (
    build_model,
    check_home,
    check_joint_values,
    frame_index,
    from_table,
    in_joint,
    joint_names,
    lead,
    slides,
    support,
    welded,
)
from app.robot.layout import NONE, find_layout, read_layout
from app.robot.meshes import BodyMesh, Description, describe
from app.robot.posture import Posture
from app.robot.tables import AS_IT_IS, Choice, RobotTable, ToolTable
from app.robot.tool import find_tool, mount, read_tool, tool_names
from app.robot.urdf import last_link, link_names, read_urdf, to_text
from app.toml import read_toml

ACCELERATION = 6.0  # [rad/s^2] of a bare URDF's turning joints, which give none
SLIDING = 2.0  # [m/s^2] of its sliding ones
LOOSE = 1.0  # [rad/s^2 or m/s^2] a follower's own limit is never what holds
RECENT = 32  # postures kept: a frame is placed where the arm was some ticks ago


@dataclass(frozen=True, eq=False, repr=False)
class Robot:
    """Who we are. All arrays are (n,), one value a joint, rad or m and their rates."""

    name: str
    title: str
    folder: Path
    links: tuple[str, ...]
    joints: tuple[str, ...]
    tool_frame: str
    skin: str | None  # the layout of its own that `robot.toml` names
    layout: Path | None  # whose covers it wears
    covers: tuple[str, ...]  # body links that are covers
    home: Array
    q_min: Array
    q_max: Array
    qd_max: Array
    qdd_max: Array
    bodies: tuple[BodyMesh, ...]  # one a body link, link frame
    rigid: tuple[RigidMesh, ...]  # the same, ready for rays
    description: Description
    supports: Array  # (L, n)
    tool_support: Array  # (n,)
    gears: Gears  # which joints follow another
    welded: NDArray[np.bool_]  # (L, L) do two body links move as one?
    T_joint_link: Array  # (L, 4, 4) of each body link in the joint that moves it, for ever
    _model: Any
    _frames: tuple[int, ...]
    _tool: int
    _data: Any  # pinocchio's scratch space; results are copied out before the next call
    eps: Array  # (L, 2) [m] the self filter's thresholds of each link, inside and across its
    # edge; NaN: the setting's
    _recent: dict[bytes, Posture] = field(default_factory=dict, init=False)  # by q, oldest first
    _placed: list[Any] = field(default_factory=list, init=False)  # the links' frames in `_data`

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_placed": []}  # a copy's scratch space is its own

    @property
    def n(self) -> int:
        """Number of joints that move."""
        return len(self.joints)

    @property
    def slides(self) -> NDArray[np.bool_]:
        """(n,) which joints are sliding ones, in metres."""
        return slides(self._model)

    def link_index(self, name: str) -> int:
        """Row of a body link; the error lists the links that there are."""
        if name not in self.links:
            raise RobotError(f"{self.name}: no body link {name!r}; {options(name, self.links)}")
        return self.links.index(name)

    def T_link_link(self, a: int, b: int) -> Array:  # noqa: N802  as the frames are named
        """(4, 4) pose of body link b in the frame of a; both must be welded. It never changes."""
        a_, b_ = self.T_joint_link[a], self.T_joint_link[b]
        return np.eye(4) if np.array_equal(a_, b_) else np.asarray(np.linalg.inv(a_) @ b_)

    def visual(self, link: str) -> Any:
        """The link's visual meshes as one trimesh.Scene in the link frame."""
        return self.description.visual(link)

    def posture(self, q: Array) -> Posture:
        """Kinematics at q (n,). One thread only: pinocchio's scratch space is shared."""
        q = np.array(q, dtype=np.float64)
        if q.shape != (self.n,):
            raise ValueError(f"q has shape {q.shape}, {self.name} has {self.n} joints")
        known = self._recent.get(q.tobytes())
        if known is not None:
            return known
        data = self._data
        pin.computeJointJacobians(self._model, data, q)
        pin.updateFramePlacements(self._model, data)
        if not self._placed:
            self._placed.extend(data.oMf[f] for f in self._frames)
        poses = np.array([T.homogeneous for T in self._placed])
        posture = Posture(
            q=freeze(q),
            T_base_link=freeze(poses),
            T_base_tool=freeze(data.oMf[self._tool].homogeneous.copy()),
            # of one joint pinocchio makes a row of it
            J_base=freeze(data.J.copy().reshape(6, self.n)),
            supports=self.supports,
            tool_support=self.tool_support,
            gears=self.gears,
        )
        if len(self._recent) == RECENT:
            del self._recent[next(iter(self._recent))]
        self._recent[q.tobytes()] = posture
        return posture


def find_robot(name: str) -> Path:
    """The folder of a robot by name (in `robots/`) or by path."""
    return find_asset(name, asset_folder("robots"), "", RobotError)


def load_robot(folder: Path, choice: Choice = AS_IT_IS) -> Robot:
    """Read a robot folder; raises `RobotError` naming the file and what to mend."""
    file = folder / "robot.toml"
    if not file.is_file():
        raise RobotError(f"{folder}: has no robot.toml; give a robot folder or write one")
    table = read_toml(file, RobotTable, RobotError)
    urdf = folder / table.urdf
    if not urdf.is_file():
        raise RobotError(f"{file}: urdf = {table.urdf!r} does not exist; name the URDF file here")
    return _assemble(read_urdf(urdf), urdf, table, file, choice)


def load_urdf(urdf: Path, choice: Choice = AS_IT_IS) -> Robot:
    """A bare URDF with its own meshes, and defaults for what it cannot say.

    Tool frame: the last link of the longest chain. Home: the middle of each joint's limits,
    those of turning joints first narrowed to half a turn either way. Acceleration limits:
    `ACCELERATION` and `SLIDING`. Body links: every link with a shape. Skin: the chosen one only.
    """
    root = read_urdf(urdf)
    name = root.get("name") or urdf.stem
    return _assemble(root, urdf, None, urdf, choice, name)


def _assemble(
    root: Element,
    urdf: Path,
    table: RobotTable | None,
    where: Path,
    choice: Choice,
    name: str = "",
) -> Robot:
    folder = where.parent
    name = table.name if table else name
    flange = table.tool_frame if table else last_link(root)
    bodies_from = choice.bodies or (table.bodies if table else "collision")
    bare = describe(to_text(root), urdf, bodies_from)
    tool, tool_frame = _mounted(root, table, folder, flange, choice.tool)
    layout = _layout(table, folder, choice.skin, name)
    worn = mount_covers(root, read_layout(layout), layout, bare.body) if layout else {}
    xml = to_text(root)
    description = describe(xml, urdf, bodies_from)
    model = build_model(xml, urdf)
    gears = read_gears(root, joint_names(model), urdf)
    lead(model, gears)
    links = _body_links(table, bare, tool, worn)
    if not links:
        raise RobotError(f"{urdf}: no link has a shape, so nothing can be kept clear of the arm")
    qdd_max = _accelerations(table, model, gears, where)
    home = _home(table, choice, model, gears, where)
    bodies = tuple(description.body(link) for link in links)
    frames = tuple(frame_index(model, link, where) for link in links)
    tip = frame_index(model, tool_frame, where)
    return Robot(
        name=name,
        title=table.title if table else name,
        folder=folder,
        links=links,
        joints=joint_names(model),
        tool_frame=tool_frame,
        skin=table.skin if table else None,
        layout=layout,
        covers=tuple(worn),
        home=freeze(home),
        q_min=freeze(model.lowerPositionLimit.copy()),
        q_max=freeze(model.upperPositionLimit.copy()),
        qd_max=freeze(model.velocityLimit.copy()),
        qdd_max=freeze(qdd_max),
        bodies=bodies,
        rigid=tuple(RigidMesh(b.vertices, b.faces) for b in bodies),
        description=description,
        supports=freeze(np.array([support(model, f) for f in frames])),
        tool_support=freeze(support(model, tip)),
        gears=gears,
        welded=freeze(welded(model, frames)),
        T_joint_link=freeze(in_joint(model, frames)),
        _model=model,
        _frames=frames,
        _tool=tip,
        _data=model.createData(),
        eps=freeze(_thresholds(table, links, where)),
    )


def _accelerations(table: RobotTable | None, model: Any, gears: Gears, where: Path) -> Array:
    """(n,) limits of the joints' accelerations; a follower's are its master's to keep."""
    limits: Array = np.where(slides(model), SLIDING, ACCELERATION)
    if table is not None:
        values = gears.spread(table.acceleration_limit, ACCELERATION)
        check_joint_values(values, "acceleration_limit", model, where)
        limits = np.array(values)
    for j in np.flatnonzero(~gears.own):
        limits[j] = abs(gears.times[j]) * limits[gears.into[j]] + LOOSE
    return limits


def _home(table: RobotTable | None, choice: Choice, model: Any, gears: Gears, where: Path) -> Array:
    """(n,) the posture to begin in; a table's values may leave out the joints that follow."""
    home = _middle(model)
    if choice.home_deg or table:
        values = list(choice.home_deg) or (table.home_deg if table else [])
        values = gears.spread(values, 0.0)
        check_joint_values(values, "home_deg", model, where)
        home = from_table(values, model)
    home = gears.place(home)
    check_home(home, model, where)
    return home


def _layout(table: RobotTable | None, folder: Path, wanted: str, name: str) -> Path | None:
    """The file of the wanted layout, else of the robot's own; None without one."""
    own = table.skin if table else None
    if not wanted and own and (folder / own).is_file():
        return folder / own  # whatever lies where a person stands
    wanted = wanted or own or NONE
    return None if wanted == NONE else find_layout(wanted, folder, name)


def _body_links(
    table: RobotTable | None, bare: Description, tool: str, worn: Mapping[str, str]
) -> tuple[str, ...]:
    """The robot's own, each followed by the covers that it wears; the tool is the last."""
    own = tuple(table.links) if table and table.links else bare.body_links
    links = [body for link in own for body in (link, *(c for c in worn if worn[c] == link))]
    return (*links, tool) if tool and tool not in links else tuple(links)


def _mounted(
    root: Element, table: RobotTable | None, folder: Path, flange: str, wanted: str
) -> tuple[str, str]:
    """Bolt the wanted tool on; the name of its link ("" without one) and the tool frame."""
    if wanted == "none":
        return "", flange
    default = table.tool if table else None
    if not wanted and isinstance(default, ToolTable):
        return default.name, mount(root, default, folder, flange)
    wanted = wanted or (default if isinstance(default, str) else "")
    if not wanted:
        return "", flange
    file = find_tool(wanted, folder)
    if file is not None:
        tool = read_tool(file)
        return tool.name, mount(root, tool, file.parent, flange)
    links = link_names(root)
    if wanted in links:
        return "", wanted
    known = ["none", *tool_names(folder), *links]
    raise RobotError(f"tool {wanted!r} is no tool and no link; {options(wanted, known)}")


def _thresholds(table: RobotTable | None, links: tuple[str, ...], where: Path) -> Array:
    """(L, 2) thresholds of single links; those of covers count where they are worn."""
    known = {*links, *map(cover_name, links)}
    columns = []
    for key in ("eps_m", "eps_edge_m"):
        eps: dict[str, float] = getattr(table, key, None) or {}
        for name in eps:
            if name not in known:
                raise RobotError(f"{where}: {key}: no body link {name!r}; {options(name, links)}")
        columns.append([eps.get(link, np.nan) for link in links])
    return np.array(columns).T.copy()


def _middle(model: Any) -> Array:
    """(n,) the middle of the limits, turning joints within half a turn of zero where they can."""
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    near_low, near_high = np.maximum(low, -np.pi), np.minimum(high, np.pi)
    narrowed = ~slides(model) & (near_low < near_high)
    low, high = np.where(narrowed, near_low, low), np.where(narrowed, near_high, high)
    return np.asarray((low + high) / 2.0)
