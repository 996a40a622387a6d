"""A robot folder: description, limits, bodies and what it is called.

`robot.toml` names the URDF and the facts that a URDF cannot hold. Kinematics come from
pinocchio, meshes from the URDF's `visual` and `collision` entries. The base frame is the
URDF's root link. A missing mesh is an error: no arm runs with a link that nobody can see or
keep clear of.
"""

from dataclasses import dataclass
from math import radians
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pinocchio as pin
from msgspec import Meta

from app.assets import asset_folder, find_asset
from app.errors import RobotError, options
from app.messages import Array, freeze
from app.raycast import RigidMesh
from app.robot.meshes import BodyMesh, Description, read_description
from app.robot.posture import Posture
from app.toml import Table, read_toml


class RobotTable(Table, frozen=True):
    """`robot.toml`. Angles in degrees here, radians everywhere else."""

    name: Annotated[str, Meta(min_length=1)]
    title: str
    urdf: str
    tool_frame: str
    home_deg: list[float]
    acceleration_limit: list[Annotated[float, Meta(gt=0)]]  # [rad/s^2] or [m/s^2]
    skin: str | None = None  # layout used when none is asked for
    links: list[str] | None = None  # body links; default: every link with a collision mesh
    eps_m: dict[str, Annotated[float, Meta(ge=0)]] | None = None  # by link, from calibration


@dataclass(frozen=True, eq=False, repr=False)
class Robot:
    """Who we are. All arrays are (n,), one value a joint, rad or m and their rates."""

    name: str
    title: str
    folder: Path
    links: tuple[str, ...]
    joints: tuple[str, ...]
    tool_frame: str
    skin: str | None
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
    _model: Any
    _frames: tuple[int, ...]
    _tool: int
    _data: Any  # pinocchio's scratch space; results are copied out before the next call
    eps: Array  # (L,) [m] the self filter's own threshold of each link, NaN: the setting's

    @property
    def n(self) -> int:
        """Number of joints that move."""
        return len(self.joints)

    def link_index(self, name: str) -> int:
        """Row of a body link; the error lists the links that there are."""
        if name not in self.links:
            raise RobotError(f"{self.name}: no body link {name!r}; {options(name, self.links)}")
        return self.links.index(name)

    def visual(self, link: str) -> Any:
        """The link's visual meshes as one trimesh.Scene in the link frame."""
        return self.description.visual(link)

    def posture(self, q: Array) -> Posture:
        """Kinematics at q (n,). One thread only: pinocchio's scratch space is shared."""
        q = np.array(q, dtype=np.float64)
        if q.shape != (self.n,):
            raise ValueError(f"q has shape {q.shape}, {self.name} has {self.n} joints")
        data = self._data
        pin.computeJointJacobians(self._model, data, q)
        pin.updateFramePlacements(self._model, data)
        poses = np.empty((len(self._frames), 4, 4))
        for i, f in enumerate(self._frames):
            poses[i] = data.oMf[f].homogeneous
        return Posture(
            q=freeze(q),
            T_base_link=freeze(poses),
            T_base_tool=freeze(data.oMf[self._tool].homogeneous.copy()),
            J_base=freeze(data.J.copy()),
            supports=self.supports,
            tool_support=self.tool_support,
        )


def find_robot(name: str) -> Path:
    """The folder of a robot by name (in `robots/`) or by path."""
    return find_asset(name, asset_folder("robots"), "", RobotError)


def load_robot(folder: Path) -> Robot:
    """Read a robot folder; raises `RobotError` naming the file and what to mend."""
    file = folder / "robot.toml"
    if not file.is_file():
        raise RobotError(f"{folder}: has no robot.toml; give a robot folder or write one")
    table = read_toml(file, RobotTable, RobotError)
    urdf = folder / table.urdf
    if not urdf.is_file():
        raise RobotError(f"{file}: urdf = {table.urdf!r} does not exist; name the URDF file here")
    description = read_description(urdf)
    model = _kinematics(urdf)
    joints = tuple(str(n) for n in model.names)[1:]
    links = tuple(table.links) if table.links else description.body_links
    bodies = tuple(description.body(link) for link in links)
    frames = tuple(_frame(model, link, file) for link in links)
    tool = _frame(model, table.tool_frame, file)
    supports = np.array([_support(model, f) for f in frames])
    home = np.array([radians(v) for v in table.home_deg])
    for key, values in (("home_deg", home), ("acceleration_limit", table.acceleration_limit)):
        if len(values) != len(joints):
            raise RobotError(
                f"{file}: {key} has {len(values)} values, the arm has {len(joints)} joints "
                f"({', '.join(joints)}); give one a joint"
            )
    q_min, q_max = model.lowerPositionLimit.copy(), model.upperPositionLimit.copy()
    outside = [j for j, h, a, b in zip(joints, home, q_min, q_max, strict=True) if not a <= h <= b]
    if outside:
        raise RobotError(f"{file}: home_deg is outside the limits of {outside[0]}; move it inside")
    return Robot(
        name=table.name,
        title=table.title,
        folder=folder,
        links=links,
        joints=joints,
        tool_frame=table.tool_frame,
        skin=table.skin,
        home=freeze(home),
        q_min=freeze(q_min),
        q_max=freeze(q_max),
        qd_max=freeze(model.velocityLimit.copy()),
        qdd_max=freeze(np.array(table.acceleration_limit)),
        bodies=bodies,
        rigid=tuple(RigidMesh(b.vertices, b.faces) for b in bodies),
        description=description,
        supports=freeze(supports),
        tool_support=freeze(_support(model, tool)),
        _model=model,
        _frames=frames,
        _tool=tool,
        _data=model.createData(),
        eps=freeze(_thresholds(table.eps_m or {}, links, file)),
    )


def _kinematics(urdf: Path) -> Any:
    try:
        model = pin.buildModelFromUrdf(str(urdf))
    except (ValueError, RuntimeError) as e:
        raise RobotError(f"{urdf}: pinocchio cannot build it ({_one_line(e)}); mend it") from e
    for name, joint in zip(list(model.names)[1:], list(model.joints)[1:], strict=True):
        if joint.nq != 1 or joint.nv != 1:
            raise RobotError(
                f"{urdf}: joint {name!r} has {joint.nv} degrees of freedom or no limits; "
                "use revolute or prismatic joints with limits"
            )
    if model.nv == 0:
        raise RobotError(f"{urdf}: has no moving joint; give an arm")
    return model


def _frame(model: Any, name: str, file: Path) -> int:
    if not model.existFrame(name, pin.FrameType.BODY):
        known = [f.name for f in model.frames if f.type == pin.FrameType.BODY]
        raise RobotError(f"{file}: no link {name!r} in the URDF; {options(name, known)}")
    return int(model.getFrameId(name, pin.FrameType.BODY))


def _thresholds(eps: dict[str, float], links: tuple[str, ...], file: Path) -> Array:
    for name in eps:
        if name not in links:
            raise RobotError(f"{file}: eps_m: no body link {name!r}; {options(name, links)}")
    return np.array([eps.get(link, np.nan) for link in links])


def _support(model: Any, frame: int) -> Array:
    """(n,) 1.0 for the joints between the base and the frame."""
    mask = np.zeros(model.nv)
    for j in list(model.supports[model.frames[frame].parentJoint])[1:]:
        mask[model.joints[j].idx_v] = 1.0
    return mask


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]
