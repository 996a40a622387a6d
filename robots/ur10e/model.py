"""The UR10e's shape: seven links from named dimensions, written as visual and body meshes.

    make robot

The arm is a few ideas repeated: a joint housing is two crossing cylinders of one radius with a
rolling-ball fillet, closed by a tilted cap; housings are joined by turned tubes and dark rings.

            cap (tilted rim, flatter top)
          .-------.
          |  hub  |=====|----------        hub: along w, the joint's axis
          |       |=====|----------        neck: along u, ends in a ring, then a tube or a mouth
          '-------'
            foot: the next joint's face, a dark ring

A housing is a signed distance field (negative inside), meshed by marching cubes, its vertices put
back on the field; everything turned is a lathe profile; a cap and the forearm's bend are skinned
from rows of points; edges that must be sharp are cut by planes. All numbers are millimetres,
measured by sections through the maker's published visual meshes; meshes are written in metres in
their link's frame. The same input gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from manifold3d import CrossSection, Manifold, Mesh, OpType
from skimage.measure import marching_cubes

from app.messages import Array
from app.robot import solids
from app.robot.solids import (
    Field,
    Materials,
    Part,
    frame,
    gradient,
    lathe,
    write_body,
    write_visual,
)

HERE = Path(__file__).parent
# --- Materials: sRGB colour, metallic, roughness -------------------------------------------------
MATERIALS: Materials = {
    "aluminium": ((216, 219, 222), 0.25, 0.42),  # tubes and tool flange, turned and bare
    "casting": ((148, 151, 155), 0.15, 0.55),  # painted housings
    "cap": ((168, 198, 217), 0.0, 0.5),  # blue-grey plastic
    "seam": ((38, 40, 43), 0.0, 0.65),  # joint rings
    "screw": ((92, 95, 99), 0.5, 0.45),
}


# --- Dimensions ----------------------------------------------------------------------------------
@dataclass(frozen=True)
class Cap:
    """Joint cap [mm]: planes are w = height + slope * u, with u towards the neck."""

    rim: float  # height of the rim's lower edge on the axis
    rim_slope: float
    top: float  # height of the flat top on the axis
    top_slope: float
    edge: float  # rounding between side and top, on the axis
    edge_slope: float  # the rounding shrinks towards the neck, where the skirt is low
    lip: float  # how far the bead stands out from the hub
    screws: tuple[float, ...]  # directions of the screw pockets from the neck [deg]
    screw_radius: float  # distance of the screws from the axis


@dataclass(frozen=True)
class Joint:
    """Joint housing [mm] in its own frame: axis w through the hub, u along the neck, v across."""

    radius: float  # hub and neck alike
    foot: float  # w of the hub's lower end
    neck: float  # u of the neck's end
    cap: Cap
    fillet: float = 5.0  # rolling ball where hub and neck cross at right angles ...
    fillet_gain: float = 20.0  # ... growing where they meet more gently (cosine of the normals)


BIG_CAP = Cap(54.7, 0.345, 87.9, 0.088, 11.5, -0.079, 1.4, (30, 90, 150, 210, 270, 330), 65.0)
MIDDLE_CAP = Cap(34.2, 0.427, 65.05, 0.130, 10.5, -0.103, 2.1, (40, 140, 220, 320), 48.0)
SMALL_CAP = Cap(29.2, 0.403, 53.9, 0.088, 9.0, -0.1, 2.0, (60, 180, 300), 38.0)

SHOULDER = Joint(radius=75.0, foot=-81.7, neck=80.2, cap=BIG_CAP)
UPPER_ARM = replace(SHOULDER, foot=-81.4, cap=replace(BIG_CAP, rim=54.0, top=87.1))
ELBOW = Joint(radius=58.1, foot=-63.4, neck=60.6, cap=MIDDLE_CAP)
FOREARM = Joint(radius=45.0, foot=-56.6, neck=53.9, cap=SMALL_CAP)
WRIST_1 = replace(FOREARM, neck=68.3)
WRIST_2 = replace(FOREARM, foot=-57.0, neck=53.4, cap=replace(SMALL_CAP, rim=28.6, top=53.4))

SHOULDER_RING = (80.2, 94.6)  # u: the lift joint's ring on the shoulder's neck
UPPER_ARM_RING = (80.0, 93.2)  # u: between housing and tube, shoulder end
ELBOW_RING = (60.6, 74.0)  # u: between tube and housing, elbow end
ELBOW_FOOT_RING = (-63.4, -77.6)  # w: the elbow joint's ring
BEND_RING = (62.7, 76.1)  # u: between bend and tube, elbow end of the forearm
FOREARM_RING = (53.9, 63.1)  # u: between tube and housing, wrist end
FOREARM_FOOT_RING = (-56.6, -66.7)  # w
WRIST_1_FOOT_RING = (-56.6, -66.6)  # w
WRIST_2_FOOT_RING = (-57.0, -67.9)  # w

UPPER_ARM_LENGTH = 612.7  # shoulder lift axis to elbow axis (DH a2)
UPPER_ARM_OFFSET = 176.2  # tube axis above the link frame (z)
FOREARM_LENGTH = 571.55  # elbow axis to wrist 1 axis (DH a3)
FOREARM_OFFSET = 39.3  # tube axis above the link frame (z)

# Tubes: radius over distance from the near joint's axis, then over distance before the far one.
# fmt: off
UPPER_ARM_TUBE_NEAR = ((93.2, 74.9), (96.2, 74.7), (112.6, 58.8), (115.0, 56.8), (118.8, 55.4),
                       (121.5, 55.2))
UPPER_ARM_TUBE_FAR = ((82.4, 55.2), (81.2, 55.4), (76.7, 57.8), (74.0, 57.9))
FOREARM_TUBE_NEAR = ((76.1, 58.0), (79.0, 57.7), (91.4, 45.7), (94.0, 43.8), (97.5, 42.7))
FOREARM_TUBE_FAR = ((71.0, 42.7), (66.0, 44.9), (63.1, 45.0))
# fmt: on

BEND_RADIUS = 58.0  # pipe of the forearm's elbow bend
BEND_CENTRE = 60.0  # u = w of the bend's centre, and its centre line's radius
BEND_CUT = 5.5  # the centre line cuts the corner by this, half way round
BEND_MOUTH = 59.4  # w of the open end, on the elbow joint's face

BEAD = 2.9  # radius of the bead round a cap's rim
DRAFT = 0.09  # of a cap's skirt: how much it narrows over its height
POCKET_DEPTH = 5.0  # of the screw pockets, under the cap's top
WALL = 1.6  # of the open mouths, which the maker shows as sheets
GROOVE = 0.7  # depth and width of the seams beside a ring

# fmt: off
BASE_PROFILE = ((0.0, 95.0), (16.0, 95.0), (19.0, 94.7), (21.5, 94.2), (23.7, 93.5), (70.0, 76.9),
                (72.5, 76.0), (75.0, 75.4), (78.0, 75.0), (85.2, 75.0))
# fmt: on
BASE_RING = (85.2, 99.3)  # z
BASE_RADIUS = 75.0
BASE_POCKET = (25.3, 85.0, 8.0, 28.5)  # floor z, screw circle radius, round, half width at 100
BASE_HOLE = (16.0, 4.3)  # depth z, radius of the mounting holes

# fmt: off
TOOL_PROFILE = ((-48.9, 45.0), (-9.1, 45.0), (-7.9, 44.0), (-6.6, 42.8), (-6.6, 31.5),
                (-0.7, 31.5), (0.0, 30.8))
# fmt: on
TOOL_CUP = -9.0  # z: the hollow behind the flange ends here
TOOL_BORE = (15.75, -6.3)  # radius, floor z: centring bore
TOOL_HOLES = (25.0, 3.3, 6.3)  # circle radius, radius, depth: four M6 threads and one dowel pin
TOOL_FLAT = (-41.0, 18.5, -41.9, -29.5)  # y, half width x, lower z, upper z: the connector's flat
TOOL_PLUG = (-35.8, 5.0, -51.0)  # z, radius, outer y: the tool connector


@dataclass(frozen=True, kw_only=True)
class Detail(solids.Detail):
    """How finely a link's mesh is made."""

    pitch: float  # cell of a field's grid, relative to the radius
    arc: int  # points on a rounded edge of a cap


VISUAL = Detail(pitch=1 / 20, segments=72, arc=7, ornaments=True, tolerance=0.03)
BODY = Detail(pitch=1 / 5.5, segments=28, arc=3, ornaments=False, tolerance=0.1)


# --- Fields --------------------------------------------------------------------------------------
def rolling_ball_union(a: Array, b: Array, cosine: Array, radius: Array | float) -> Array:
    """Union filled by a ball touching both surfaces, whose normals have this `cosine` between them.

    With the ball's centre at distance `radius` from both, its sector lies between the two contacts.
    Unlike the usual smooth minimum the filling vanishes where the surfaces become tangent.
    """
    x, y = a - radius, b - radius
    sine2 = np.maximum(1 - cosine**2, 1e-9)
    sector = (x - cosine * y <= 0) & (y - cosine * x <= 0)
    ball = radius - np.sqrt(np.maximum(x * x + y * y - 2 * cosine * x * y, 0) / sine2)
    return np.where(sector, ball, np.minimum(a, b))


def housing_field(joint: Joint) -> Field:
    """Endless hub and one-sided neck with their fillet."""

    def field(p: Array) -> Array:
        u, v, w = p.T
        ahead = np.maximum(u, 0)  # behind the axis the neck ends in a ball, hidden in the hub
        to_hub, to_neck = np.hypot(u, v), np.sqrt((u - ahead) ** 2 + v * v + w * w)
        cosine = np.clip((v * v + u * (u - ahead)) / np.maximum(to_hub * to_neck, 1e-9), -1, 1)
        ball = joint.fillet + joint.fillet_gain * np.clip(cosine, 0, 1)
        return rolling_ball_union(to_hub - joint.radius, to_neck - joint.radius, cosine, ball)

    return field


def mesh_field(field: Field, low: Sequence[float], high: Sequence[float], pitch: float) -> Manifold:
    """Solid of a field inside a box, by marching cubes on a coarse grid.

    The vertices are then put on the field exactly, so that the error left is the sagitta of one
    cell (pitch^2 / 8 radius). The two cells nearest to the box's sides are not: cut them off.
    """
    axes = [np.arange(a - pitch, b + 2 * pitch, pitch) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    first, last = [a[1] for a in axes], [a[-2] for a in axes]
    box = np.max(np.maximum(first - grid, grid - last), axis=1) + 0.4 * pitch
    volume = np.maximum(field(grid), box).reshape([len(a) for a in axes])
    p, f, _, _ = marching_cubes(volume, 0.0, spacing=(pitch,) * 3, gradient_direction="descent")
    p = p.astype(float) + [a[0] for a in axes]
    free = np.all((p > np.add(first, pitch)) & (p < np.subtract(last, pitch)), axis=1)
    for _ in range(3):
        p[free] -= field(p[free])[:, None] * gradient(field, p[free])
    solid = Manifold(Mesh(p.astype(np.float32), f.astype(np.uint32)))
    if solid.is_empty():
        raise ValueError(f"no solid comes of a field at pitch {pitch:.2f} mm: take another")
    return solid


# --- Solids --------------------------------------------------------------------------------------
def skin_rows(rows: Sequence[Array]) -> Manifold:
    """Solid through closed rows of points (n, 3), each end closed by a fan about its mean.

    Seen from the last row back to the first, the points go anticlockwise.
    """
    p, n, m = np.vstack([*rows, rows[0].mean(0), rows[-1].mean(0)]), len(rows[0]), len(rows)
    i = np.arange(n)
    j = (i + 1) % n
    first, last = np.full(n, n * m), np.full(n, n * m + 1)
    f = [np.column_stack([first, j, i]), np.column_stack([last, i + n * (m - 1), j + n * (m - 1)])]
    for k in range(m - 1):
        a, b, c, d = i + n * k, j + n * k, j + n * (k + 1), i + n * (k + 1)
        f += [np.column_stack([a, b, c]), np.column_stack([a, c, d])]
    return Manifold(Mesh(p.astype(np.float32), np.vstack(f).astype(np.uint32)))


ALONG_U = frame((0, 0, 0), (0, 0, -1), (1, 0, 0))  # turns a lathe's axis from w to u
UPRIGHT = frame((0, 0, 0), (1, 0, 0), (0, 0, 1))


def at(place: Array, parts: list[Part]) -> list[Part]:
    """Parts of a joint's frame, put into the link's by `place`."""
    return [replace(part, place=place) for part in parts]


def ring(span: tuple[float, float], radius: float, detail: Detail, along: Array) -> Part:
    """A dark ring; its neighbours start a groove's width away, which draws the seams."""
    a, b = min(span), max(span)
    low = radius - GROOVE
    profile = [(a - 1, low), (b + 1, low)]  # reaching into the neighbours: no faces on faces
    if detail.ornaments:
        profile[1:1] = [
            (a + GROOVE, low),
            (a + GROOVE, radius),
            (b - GROOVE, radius),
            (b - GROOVE, low),
        ]
    return Part("seam", lathe(profile, detail).transform(along))


def foot_ring(span: tuple[float, float], radius: float, detail: Detail) -> Part:
    """The ring at a hub's foot: a cup, whose floor the next link's neck faces."""
    top, end = span
    low = radius - GROOVE
    profile = [(end, low), (top + 1, low)]
    if detail.ornaments:
        profile[:1] = [(end, radius), (top - GROOVE, radius), (top - GROOVE, low)]
    outer = lathe(profile, detail)
    cup = lathe([(end - 1, radius - WALL), (top - 0.5, radius - WALL)], detail)
    return Part("seam", outer - cup)


def cap_pockets(joint: Joint, detail: Detail) -> tuple[Manifold, Manifold]:
    """Screw pockets to cut from the cap, and the screws in them."""
    cap, size = joint.cap, 0.055 * joint.radius + 1.6
    pockets, screws = [], []
    for degrees in cap.screws:
        angle = np.radians(degrees)
        u, v = cap.screw_radius * np.cos(angle), cap.screw_radius * np.sin(angle)
        floor = cap.top + cap.top_slope * u - POCKET_DEPTH
        circle = CrossSection.circle(size, 24)
        slot = CrossSection.batch_hull([circle, circle.translate((2 * size, 0))]).rotate(degrees)
        pockets.append(slot.translate((u, v)).extrude(40).translate((0, 0, floor)))
        head = lathe([(-1, 0.7 * size), (0.9, 0.7 * size), (1.4, 0.55 * size)], detail, 16)
        screws.append(head.translate((u, v, floor)))
    return Manifold.compose(pockets), Manifold.compose(screws)


def fillet(corner: Array, back: Array, ahead: Array, radius: float, points: int) -> Array:
    """Arc (points, 2) rounding a corner between its legs, the unit directions back and ahead."""
    half = np.arccos(np.clip(back @ ahead, -1, 1)) / 2
    bisector = (back + ahead) / np.linalg.norm(back + ahead)
    centre = corner + bisector * radius / np.sin(half)
    start, end = corner + back * radius / np.tan(half), corner + ahead * radius / np.tan(half)
    a, b = np.arctan2(*(start - centre)[::-1]), np.arctan2(*(end - centre)[::-1])
    sweep = (b - a + np.pi) % (2 * np.pi) - np.pi
    angles = a + sweep * np.linspace(0, 1, points)
    return centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def cap_solid(joint: Joint, detail: Detail) -> Manifold:
    """The cap: a lathe whose profile changes round the turn, as its rim and its top are tilted.

    A profile runs from the axis along the rim's plane, over the bead, up the drafted skirt, round
    the edge and along the top back to the axis.
    """
    cap, r = joint.cap, joint.radius
    skirt = r - 0.2  # radius of the skirt above the bead
    seat = r + cap.lip - BEAD  # radius of the bead's centre
    shut = np.arccos((skirt - seat) / BEAD)  # where the bead meets the skirt
    bead = np.linspace(-np.pi / 2, shut, max(detail.arc - 1, 3))
    profiles = []
    turns = 2 * np.pi * np.arange(detail.segments) / detail.segments
    for turn in turns:
        rise, slope = cap.rim_slope * np.cos(turn), cap.top_slope * np.cos(turn)
        across = seat + BEAD * np.cos(bead)
        lip = np.column_stack([across, cap.rim + rise * across + BEAD * (1 + np.sin(bead))])
        # Skirt: radius = low - DRAFT * (w - w_low); top: w = cap.top + slope * radius.
        low, w_low = lip[-1]
        w = (cap.top + slope * (low + DRAFT * w_low)) / (1 + slope * DRAFT)
        corner = np.array([low - DRAFT * (w - w_low), w])
        back = np.array([DRAFT, -1.0]) / np.hypot(1, DRAFT)
        ahead = np.array([-1.0, -slope]) / np.hypot(1, slope)
        radius = min(cap.edge + cap.edge_slope * r * np.cos(turn), 0.85 * (w - w_low))
        profiles.append(np.vstack([lip, fillet(corner, back, ahead, radius, detail.arc)]))
    outline = np.array(profiles)  # (turns, points, 2)
    across, height = outline[..., 0], outline[..., 1]
    x, y = across * np.cos(turns)[:, None], across * np.sin(turns)[:, None]
    return skin_rows(list(np.stack([x, y, height], axis=-1).swapaxes(0, 1)))


def joint_hollow(joint: Joint, detail: Detail) -> Manifold:
    """What an open neck looks into: the neck's bore, the hub's inside, the cap's."""
    inside, cap = joint.radius - WALL, joint.cap
    narrow = inside - 0.5  # within the hub's inside at their common tangents
    bore = lathe([(0, narrow), (joint.neck + 1, narrow)], detail).transform(ALONG_U)
    hub = lathe([(joint.foot + WALL, inside), (cap.top, inside)], detail)
    rim = np.array([-cap.rim_slope, 0, 1]) / np.hypot(1, cap.rim_slope)
    hub = hub.trim_by_plane(tuple(-rim), -(cap.rim + 1) * rim[2])
    inner_cap = replace(
        cap, rim=cap.rim + 0.5, top=cap.top - POCKET_DEPTH - 1
    )  # clear of the screw pockets
    return bore + hub + cap_solid(replace(joint, radius=inside, cap=inner_cap), detail)


def joint_parts(joint: Joint, detail: Detail, mouth: bool = False) -> list[Part]:
    """Housing and cap of a joint in its own frame; with `mouth` the neck is open at its end."""
    r, cap = joint.radius, joint.cap
    pitch = detail.pitch * r
    spare = 2.6 * pitch  # cut off again; no whole cells, lest vertices lie in the cutting planes
    shape = housing_field(joint)
    housing = mesh_field(
        shape,
        (-r - spare, -r - spare, joint.foot - spare),
        (joint.neck + spare, r + spare, cap.top + spare),
        pitch,
    ).simplify(detail.tolerance)
    rim = np.array([-cap.rim_slope, 0, 1]) / np.hypot(1, cap.rim_slope)
    under_cap = cap.rim * rim[2] + 1.5  # hidden in the bead: no faces on faces
    housing = housing.trim_by_plane((-1, 0, 0), -joint.neck).trim_by_plane((0, 0, 1), joint.foot)
    # The rim's plane rises towards the neck: it cuts the hub only, the neck stays below it.
    housing = housing.trim_by_plane(tuple(-rim), -under_cap)
    cover = cap_solid(joint, detail)
    if mouth:
        hollow = joint_hollow(joint, detail)
        housing, cover = housing - hollow, cover - hollow
    parts = [Part("casting", housing, shape), Part("cap", cover)]
    if detail.ornaments:
        pockets, screws = cap_pockets(joint, detail)
        parts = [parts[0], Part("cap", cover - pockets), Part("screw", screws)]
    return parts


# --- Links ---------------------------------------------------------------------------------------
def base_link_inertia(detail: Detail) -> list[Part]:
    """The base: a turned cone with four screw pockets; it has no joint housing."""
    floor, circle, round_, width = BASE_POCKET
    depth, hole_radius = BASE_HOLE
    round_end = CrossSection.circle(round_, 24).translate((circle, 0))
    mouth = CrossSection([[(circle, -round_), (100, -width), (100, width), (circle, round_)]])
    wedge = CrossSection.batch_hull([round_end, mouth])
    pocket = wedge.extrude(60).translate((0, 0, floor))
    if detail.ornaments:
        pocket += CrossSection.circle(hole_radius, 24).extrude(30).translate((circle, 0, depth))
    pockets = [pocket.rotate((0, 0, 45 + 90 * k)) for k in range(4)]
    body = lathe(BASE_PROFILE, detail) - Manifold.batch_boolean(pockets, OpType.Add)
    top = ring(BASE_RING, BASE_RADIUS, detail, UPRIGHT)
    face = top.solid.trim_by_plane((0, 0, -1), -BASE_RING[1])
    return [Part("casting", body), replace(top, solid=face)]


def shoulder_link(detail: Detail) -> list[Part]:
    """The shoulder: hub on the pan axis, neck towards the lift joint."""
    ring_ = ring(SHOULDER_RING, SHOULDER.radius, detail, ALONG_U)
    face = ring_.solid.trim_by_plane((-1, 0, 0), -SHOULDER_RING[1])
    place = frame((0, 0, 0), (0, -1, 0), (0, 0, 1))
    return at(place, [*joint_parts(SHOULDER, detail), replace(ring_, solid=face)])


def upper_arm_link(detail: Detail) -> list[Part]:
    """The upper arm: shoulder housing, tube, elbow housing."""
    near = frame((0, 0, UPPER_ARM_OFFSET), (-1, 0, 0), (0, 0, 1))
    far = frame((-UPPER_ARM_LENGTH, 0, UPPER_ARM_OFFSET), (1, 0, 0), (0, 0, 1))
    tube = tube_part(UPPER_ARM_TUBE_NEAR, UPPER_ARM_TUBE_FAR, UPPER_ARM_LENGTH, detail)
    shoulder_end = [
        *joint_parts(UPPER_ARM, detail),
        ring(UPPER_ARM_RING, UPPER_ARM.radius, detail, ALONG_U),
        tube,
    ]
    elbow_end = [
        *joint_parts(ELBOW, detail),
        ring(ELBOW_RING, ELBOW.radius, detail, ALONG_U),
        foot_ring(ELBOW_FOOT_RING, ELBOW.radius, detail),
    ]
    return [*at(near, shoulder_end), *at(far, elbow_end)]


def forearm_link(detail: Detail) -> list[Part]:
    """The forearm: bent pipe at the elbow, tube, wrist housing."""
    near = frame((0, 0, FOREARM_OFFSET), (-1, 0, 0), (0, 0, 1))
    far = frame((-FOREARM_LENGTH, 0, FOREARM_OFFSET), (1, 0, 0), (0, 0, -1))
    elbow_end = [
        bend_part(detail),
        ring(BEND_RING, BEND_RADIUS, detail, ALONG_U),
        tube_part(FOREARM_TUBE_NEAR, FOREARM_TUBE_FAR, FOREARM_LENGTH, detail),
    ]
    wrist_end = [
        *joint_parts(FOREARM, detail),
        ring(FOREARM_RING, FOREARM.radius, detail, ALONG_U),
        foot_ring(FOREARM_FOOT_RING, FOREARM.radius, detail),
    ]
    return [*at(near, elbow_end), *at(far, wrist_end)]


def wrist_1_link(detail: Detail) -> list[Part]:
    """The first wrist: hub on the second wrist's axis, neck towards the forearm."""
    foot = foot_ring(WRIST_1_FOOT_RING, WRIST_1.radius, detail)
    place = frame((0, 0, 0), (0, 0, -1), (0, 1, 0))
    return at(place, [*joint_parts(WRIST_1, detail, mouth=True), foot])


def wrist_2_link(detail: Detail) -> list[Part]:
    """The second wrist: as the first, with a shorter neck."""
    foot = foot_ring(WRIST_2_FOOT_RING, WRIST_2.radius, detail)
    place = frame((0, 0, 0), (0, 0, -1), (0, -1, 0))
    return at(place, [*joint_parts(WRIST_2, detail, mouth=True), foot])


def wrist_3_link(detail: Detail) -> list[Part]:
    """The tool flange (ISO 9409-1-50-4-M6) with the connector on its side."""
    low = TOOL_PROFILE[0][0]
    body = lathe(TOOL_PROFILE, detail)
    body -= lathe([(low - 1, 45 - WALL), (TOOL_CUP, 45 - WALL)], detail)
    bore, floor = TOOL_BORE
    body -= lathe([(floor, bore), (1, bore)], detail)
    y, half, z0, z1 = TOOL_FLAT
    # The flat stays outside the hollow: a wall of the mouth's thickness is put behind it.
    backing = Manifold.cube((2 * half + 4, 8, z1 - z0 + 9)).translate((-half - 2, y - 4, z0 - 4.5))
    body += backing ^ lathe([(low, 45.0), (TOOL_CUP, 45.0)], detail)
    notch = CrossSection([[(y, z0), (y, z1), (y - 6, z1 + 6), (y - 6, z0 - 6)]])
    cut = notch.extrude(2 * half).transform(frame((-half, 0, 0), (0, 1, 0), (1, 0, 0)))
    body -= cut
    circle, hole, depth = TOOL_HOLES
    if detail.ornaments:
        for degrees in (-90, 45, 135, 225, 315):
            drill = CrossSection.circle(hole, 16).extrude(depth + 1).translate((circle, 0, -depth))
            body -= drill.rotate((0, 0, degrees))
    z, radius, end = TOOL_PLUG
    plug = lathe([(0, radius), (-end + y - 1.5, radius), (-end + y, radius - 1.5)], detail)
    plug = plug.transform(frame((0, y + 0.5, z), (1, 0, 0), (0, -1, 0)))
    return [Part("aluminium", body), Part("seam", plug)]


def tube_part(
    near: Sequence[tuple[float, float]],
    far: Sequence[tuple[float, float]],
    length: float,
    detail: Detail,
) -> Part:
    """A turned tube along u from the near joint's ring to the far one's."""
    profile = [*near, *((length - u, r) for u, r in far)]
    return Part("aluminium", lathe(profile, detail).transform(ALONG_U))


def bend_part(detail: Detail) -> Part:
    """The forearm's elbow: a bent pipe, open on the elbow joint's face."""
    end = BEND_RING[0]

    def pipe(radius: float) -> Manifold:
        psi = 2 * np.pi * np.arange(detail.segments) / detail.segments
        rows = []
        for turn in np.linspace(0, np.pi / 2, detail.segments // 5 + 1):
            line = BEND_CENTRE - BEND_CUT * np.sin(2 * turn) ** 2
            # Inside the bend the pipe would fold over itself: it stops short of the centre.
            away = np.maximum(line + radius * np.cos(psi), 1.0)
            u, w = BEND_CENTRE - away * np.cos(turn), BEND_CENTRE - away * np.sin(turn)
            rows.append(np.column_stack([u, radius * np.sin(psi), w]))
        return skin_rows([*rows, rows[-1] + [end - BEND_CENTRE, 0, 0]])

    solid = pipe(BEND_RADIUS) - pipe(BEND_RADIUS - WALL).trim_by_plane((-1, 0, 0), 3 - end)
    return Part("casting", solid.trim_by_plane((0, 0, -1), -BEND_MOUTH))


LINKS = (
    base_link_inertia,
    shoulder_link,
    upper_arm_link,
    forearm_link,
    wrist_1_link,
    wrist_2_link,
    wrist_3_link,
)


def main(meshes: Path = HERE / "meshes") -> None:
    """Write every link's meshes into the folders `visual` and `body` of `meshes`."""
    for folder in ("visual", "body"):
        (meshes / folder).mkdir(parents=True, exist_ok=True)
    for link in LINKS:
        name = link.__name__
        size = write_visual(link(VISUAL), meshes / "visual" / f"{name}.glb", MATERIALS)
        faces = write_body(link(BODY), meshes / "body" / f"{name}.stl")
        print(f"{name:20} visual {size / 1024:6.0f} KiB   body {faces:5} faces")


if __name__ == "__main__":
    main()
