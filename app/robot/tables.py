"""What may stand in `robot.toml` and in a tool's file, and what a person may choose beside."""

from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from app.toml import Table

Bodies = Literal["collision", "visual"]
Vector = tuple[float, float, float]


class ToolTable(Table, frozen=True, kw_only=True):
    """`[tool]` of `robot.toml`, or a file `tools/NAME.toml` of its own.

    name:             the body link's name; the tool frame becomes the link `<name>_tip`.
    body:             mesh that distances are measured to, beside the TOML file; closed, metres,
                      in the frame that it is bolted to (robot.toml's `tool_frame`).
    visual:           mesh that is shown; default: `body`.
    mass_kg, centre_of_mass_m: of the tool; its inertia is that of the evenly filled body.
    position_m, rpy_deg: the tool frame, seen from the frame that the tool is bolted to.
    """

    name: Annotated[str, Meta(min_length=1)]
    body: str
    visual: str | None = None
    mass_kg: Annotated[float, Meta(gt=0)]
    centre_of_mass_m: Vector
    position_m: Vector
    rpy_deg: Vector = (0.0, 0.0, 0.0)


class RobotTable(Table, frozen=True):
    """`robot.toml`.

    name, title:        what it is called in messages, and on the page.
    urdf:               the description, beside `robot.toml`.
    tool_frame:         the URDF's link whose pose the goal is for; a tool is bolted to it.
    home_deg:           posture to begin in, one value a joint: degrees, mm for a sliding joint.
    acceleration_limit: of each joint [rad/s^2] or [m/s^2].
    skin:               layout used when none is asked for, a path beside `robot.toml`.
    links:              body links, which distances are measured to; default: every link that
                        has a shape.
    tool:               what is bolted on when nothing else is asked for: a `[tool]` table (see
                        `ToolTable`), the path of a file with one, or a name in `tools/`;
                        default: none.
    eps_m, eps_edge_m:  the self filter's thresholds of single links [m], from calibration: for
                        zones that see only the link, and for zones across its edge.
    """

    name: Annotated[str, Meta(min_length=1)]
    title: str
    urdf: str
    tool_frame: str
    home_deg: list[float]
    acceleration_limit: list[Annotated[float, Meta(gt=0)]]
    skin: str | None = None
    links: list[str] | None = None
    tool: ToolTable | str | None = None
    eps_m: dict[str, Annotated[float, Meta(ge=0)]] | None = None
    eps_edge_m: dict[str, Annotated[float, Meta(ge=0)]] | None = None


@dataclass(frozen=True, slots=True)
class Choice:
    """What a person may choose about any robot.

    tool:     a tool's name or TOML file, a link of the URDF as tool frame, "none", or "" for
              the robot's own.
    home_deg: posture to begin in, degrees (mm for a sliding joint); empty: the robot's own.
    bodies:   which meshes of the URDF distances are measured to.
    """

    tool: str = ""
    home_deg: tuple[float, ...] = ()
    bodies: Bodies = "collision"


AS_IT_IS = Choice()
