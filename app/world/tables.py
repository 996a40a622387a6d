"""What may stand in a scene's file, and in the shape of a new obstacle.

Metres, degrees and seconds. A pose is a place and its turns about the base's fixed x, y, z axes.
"""

from typing import Annotated, Literal

from msgspec import Meta

from app.toml import Name, NotNegative, Positive, Table, Vector

NOT_TURNED: Vector = (0.0, 0.0, 0.0)
GREY = "#9aa0a6"
Size = tuple[Positive, Positive, Positive]
Stature = Annotated[float, Meta(ge=0.5, le=2.5)]
Colour = Annotated[
    str, Meta(pattern="^#[0-9a-fA-F]{6}$", extra_json_schema={"description": "'#rrggbb'"})
]


class BoxShape(Table, frozen=True, tag_field="kind", tag="box"):
    """Edge lengths along x, y, z."""

    size_m: Size


class PanelShape(Table, frozen=True, tag_field="kind", tag="panel"):
    """Width along x, height along y; its thickness lies along z."""

    size_m: tuple[Positive, Positive]
    thickness_m: Positive = 0.01


class SphereShape(Table, frozen=True, tag_field="kind", tag="sphere"):
    """A ball."""

    radius_m: Positive


class CylinderShape(Table, frozen=True, tag_field="kind", tag="cylinder"):
    """Along z."""

    radius_m: Positive
    length_m: Positive


class CapsuleShape(Table, frozen=True, tag_field="kind", tag="capsule"):
    """Along z; the length is that of its straight part."""

    radius_m: Positive
    length_m: Positive


class MeshShape(Table, frozen=True, tag_field="kind", tag="mesh"):
    """A surface from a file (STL, OBJ, GLB) beside the scene, times `scale`."""

    file: str
    scale: Positive = 1.0


ShapeTable = BoxShape | PanelShape | SphereShape | CylinderShape | CapsuleShape | MeshShape


class StillMotion(Table, frozen=True, tag_field="kind", tag="still"):
    """Stays where it is."""


class LineMotion(Table, frozen=True, tag_field="kind", tag="line"):
    """From the body's own place to another, and back unless `once`."""

    to_m: Vector
    speed_mps: Positive
    once: bool = False
    dwell_s: NotNegative = 0.0


class WaypointsMotion(Table, frozen=True, tag_field="kind", tag="waypoints"):
    """From the body's own place over several points, and to the first again with `loop`."""

    points_m: tuple[Vector, ...]
    speed_mps: Positive
    loop: bool = True
    dwell_s: NotNegative = 0.0


class CircleMotion(Table, frozen=True, tag_field="kind", tag="circle"):
    """Round a centre about an axis; a round takes `period_s`."""

    centre_m: Vector
    axis: Vector
    radius_m: Positive
    period_s: Positive
    phase_deg: float = 0.0


MotionTable = StillMotion | LineMotion | WaypointsMotion | CircleMotion


class BodyTable(Table, frozen=True):
    """One `[[body]]`. A static one is part of the known cell, with a margin around it.

    reflectance: of its surface for a sensor's light; left out, a seed draws it.
    """

    name: Name
    shape: ShapeTable
    position_m: Vector = NOT_TURNED
    rpy_deg: Vector = NOT_TURNED
    colour: Colour = GREY
    movable: bool | None = None  # None: unless it is static
    static: bool = False
    margin_m: NotNegative = 0.03
    motion: MotionTable | None = None
    reflectance: Annotated[float, Meta(gt=0, le=1)] | None = None


class StopTable(Table, frozen=True):
    """Where a person stops on the ground, how long, and what a hand reaches for.

    place: its name for who tells of it, such as 'the door'.
    """

    at_m: tuple[float, float]
    dwell_s: NotNegative = 0.0
    reach_m: Vector | None = None
    place: str = ""


class PersonTable(Table, frozen=True):
    """One `[[person]]`; with a seed the person's habits vary, and the stature where it is left out.

    order: "given", or "varied": the seed draws which stop comes next, and for how long.
    clip:  a BVH file beside the scene instead of stops; it begins at `at_m`, looking to
           `heading_deg` from ahead of the arm to its left, and is played again and again.
    """

    name: Name
    speed_mps: Positive = 0.6
    stops: tuple[StopTable, ...] = ()
    loop: bool = True
    hand: Literal["left", "right"] = "right"
    seed: Annotated[int, Meta(ge=0)] | None = None
    stature_m: Stature | None = None
    order: Literal["given", "varied"] = "given"
    clip: str = ""
    at_m: tuple[float, float] | None = None
    heading_deg: float = 0.0


class CropTable(Table, frozen=True):
    """One `[[crop]]`: a box of the known cell that the scene does not show as a body."""

    name: Name
    size_m: Size
    position_m: Vector = NOT_TURNED
    rpy_deg: Vector = NOT_TURNED


class PlaneTable(Table, frozen=True):
    """One `[[plane]]`: all below it, against its own z axis, is known; `size_m` is only drawn."""

    name: Name
    position_m: Vector = NOT_TURNED
    rpy_deg: Vector = NOT_TURNED
    size_m: tuple[Positive, Positive] = (2.0, 2.0)


class GoalTable(Table, frozen=True):
    """`goal`: where the tool should go at first."""

    position_m: Vector
    rpy_deg: Vector = NOT_TURNED


class SceneTable(Table, frozen=True):
    """A scene's file; see `app.world.scene.Scene`."""

    title: str
    body: tuple[BodyTable, ...] = ()
    person: tuple[PersonTable, ...] = ()
    crop: tuple[CropTable, ...] = ()
    plane: tuple[PlaneTable, ...] = ()
    goal: GoalTable | None = None
    home_deg: Annotated[tuple[float, ...], Meta(min_length=1)] | None = None
    robot: str = ""
