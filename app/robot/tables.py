"""What may stand in `robot.toml`, in a tool's file and in `[cover]`, and what a person may choose.

The docstrings tell every key as `key: text`; `robots/README.md` is made from them.
"""

from dataclasses import dataclass
from typing import Literal

from app.toml import Name, NotNegative, Positive, Table, Vector

Bodies = Literal["collision", "visual"]


class ToolTable(Table, frozen=True, kw_only=True):
    """`[tool]` of `robot.toml`, or a file `tools/NAME.toml` of its own.

    name:             the body link's name; the tool frame becomes the link `<name>_tip`.
    body:             mesh that distances are measured to, beside the TOML file; closed, metres,
                      in the frame that it is bolted to (robot.toml's `tool_frame`).
    box_m:            instead of `body`: a box of these edges along x, y and z.
    cylinder_m:       instead of `body`: a cylinder of this radius and length, along z.
    sphere_m:         instead of `body`: a ball of this radius.
    centre_m:         middle of such a shape; default: it stands on the frame, along z.
    visual:           mesh that is shown; default: `body`.
    mass_kg:          of the tool; its inertia is that of the evenly filled body.
    centre_of_mass_m: in the frame that it is bolted to; of a box, a cylinder or a ball its middle.
    position_m:       the tool frame, seen from the frame that the tool is bolted to.
    rpy_deg:          its turn about the fixed x, y and z axes.
    """

    name: Name
    body: str | None = None
    box_m: tuple[Positive, Positive, Positive] | None = None
    cylinder_m: tuple[Positive, Positive] | None = None
    sphere_m: Positive | None = None
    centre_m: Vector | None = None
    visual: str | None = None
    mass_kg: Positive
    centre_of_mass_m: Vector | None = None
    position_m: Vector
    rpy_deg: Vector = (0.0, 0.0, 0.0)


class CoverTable(Table, frozen=True, kw_only=True):
    """`[cover]` of a layout: a printed cover goes round each of its rings, with a window over every
    sensor. Its meshes are made when the layout is loaded; an empty `[cover]` will do.

    inner_radius_m:    of its bore; default: the link's radius there, found from its mesh, and half
                       a millimetre of play.
    foot_radius_m:     of its slope's end on the link; default: 2.3 mm more than the bore.
    foot_half_width_m: half of its width on the link.
    land_half_width_m: half of the width of its flat rim, in which the windows are.
    rim_m:             how far the rim stands out beyond the lenses.
    floor_m:           how far a window's floor lies below its lens.
    window_half_m:     half sizes of that floor, round the link and along it.
    body:              a modelled mesh of all covers instead, beside the layout; closed, metres, in
                       the frame of the one link that wears them.
    visual:            mesh that is shown beside `body`; default: `body`.
    """

    inner_radius_m: Positive | None = None
    foot_radius_m: Positive | None = None
    foot_half_width_m: Positive = 0.023
    land_half_width_m: Positive = 0.012
    rim_m: Positive = 0.002
    floor_m: Positive = 0.001
    window_half_m: tuple[Positive, Positive] = (0.005, 0.004)
    body: str | None = None
    visual: str | None = None


class RobotTable(Table, frozen=True):
    """`robot.toml`: what a URDF cannot tell.

    name:               what the robot is called in messages.
    title:              what it is called on the page.
    urdf:               the description, beside `robot.toml`.
    tool_frame:         the URDF's link whose pose the goal is for; a tool is bolted to it.
    home_deg:           posture to begin in, one value a joint: degrees, mm for a sliding joint.
    acceleration_limit: of each joint [rad/s^2] or [m/s^2].
    skin:               layout used when none is asked for: a path beside `robot.toml`, or a name in
                        `skin/`; default: none.
    links:              body links, which distances are measured to; default: every link that
                        has a shape. The covers of a layout are none of its business.
    bodies:             meshes of the URDF that distances are measured to; collision meshes are
                        often hulls, which swallow what is mounted on the link.
    tool:               what is bolted on when nothing else is asked for: a `[tool]` table, the path
                        of a file with one, or a name in `tools/`; default: none.
    eps_m:              the self filter's thresholds of single links [m], from calibration, for
                        zones that see only the link.
    eps_edge_m:         the same for zones across a link's edge.
    """

    name: Name
    title: str
    urdf: str
    tool_frame: str
    home_deg: list[float]
    acceleration_limit: list[Positive]
    skin: str | None = None
    links: list[str] | None = None
    bodies: Bodies = "collision"
    tool: ToolTable | str | None = None
    eps_m: dict[str, NotNegative] | None = None
    eps_edge_m: dict[str, NotNegative] | None = None


@dataclass(frozen=True, slots=True)
class Choice:
    """What a person may choose about any robot.

    tool:     a tool's name or TOML file, a link of the URDF as tool frame, "none", or "" for
              the robot's own.
    home_deg: posture to begin in, degrees (mm for a sliding joint); empty: the robot's own.
    bodies:   which meshes of the URDF distances are measured to; None: the robot's own.
    skin:     the layout whose covers are worn: its name or path, "none", or "" for the robot's own.
    """

    tool: str = ""
    home_deg: tuple[float, ...] = ()
    bodies: Bodies | None = None
    skin: str = ""


AS_IT_IS = Choice()
