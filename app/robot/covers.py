"""The covers of a layout: what goes round each of its rings, as a body of the link it sits on.

All follows from the layout's `[cover]` and from where the link's mesh is round; see
`app.robot.cover_solid` for the shape. The meshes are made when a layout is loaded and kept in the
user's cache folder by a digest of what they follow from; a layout may also name modelled ones.
"""

import hashlib
import json
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from app.errors import RobotError, options
from app.messages import Array
from app.robot.bolted import bolt, mesh_shape, read_solid
from app.robot.file_cache import cached_folder
from app.robot.meshes import BodyMesh
from app.robot.roundness import BINS, OFF, outline
from app.robot.skin_file import RingTable, SkinTable, ring_axes
from app.robot.tables import CoverTable
from app.robot.urdf import link_names

PLAY = 0.0005  # [m] between a link and its cover's bore
SLOPE = 0.0023  # [m] thickness of a foot's edge: printed thinner, it breaks
WALL = 0.001  # [m] least thickness between a window's floor and the bore
DENSITY = 459.0  # [kg/m^3] printed hollow: three rings of 654 cm3 weigh 0.3 kg
CUTS = 5  # through the link, over the width of a cover

Point = tuple[float, float, float]
BodyOf = Callable[[str], BodyMesh]  # a link's mesh by its name


class CoverShape(NamedTuple):
    """One cover, all that its shape follows from: lengths in metres, link frame.

    centre, axis, start: of the ring, unit vectors; the first sensor is along `start`.
    lens:  radius of the circle on which the lenses are.   windows: one a sensor, evenly spaced.
    tilt:  [deg] of the sensors towards the axis' direction.
    inner: radius of the bore.   The rest is as in `CoverTable`.
    """

    centre: Point
    axis: Point
    start: Point
    lens: float
    windows: int
    tilt: float
    inner: float
    foot_radius: float
    foot_half_width: float
    land_half_width: float
    rim: float
    floor: float
    window_half: tuple[float, float]


def cover_name(link: str) -> str:
    """The body link of the covers that a link wears."""
    return f"{link.removesuffix('_link')}_cover"


def mount_covers(root: Element, table: SkinTable, path: Path, body_of: BodyOf) -> dict[str, str]:
    """Bolt the covers of a layout to a URDF: cover link -> the link that wears it."""
    worn = {}
    links = link_names(root)
    for ring in table.ring:
        if ring.link not in links:
            raise RobotError(
                f"{path}: ring {ring.name!r}: link = {ring.link!r} is no link of the robot; "
                f"{options(ring.link, links)}"
            )
    for link, shapes in shapes_of(table, path, body_of).items():
        body, visual = _named(table.cover, path) or _made(shapes)
        solid, name = read_solid(body, "the covers' mesh"), cover_name(link)
        tensor = DENSITY * np.asarray(solid.moment_inertia)
        shapes_ = mesh_shape(body), mesh_shape(visual)
        bolt(root, name, link, shapes_, (DENSITY * solid.volume, solid.center_mass, tensor))
        worn[name] = link
    return worn


def shapes_of(
    table: SkinTable, path: Path, body_of: BodyOf | None = None
) -> dict[str, list[CoverShape]]:
    """The covers of each link that wears some; raises `RobotError` where one does not fit.

    body_of: is asked for a link's mesh where `[cover]` gives no inner radius.
    """
    out: dict[str, list[CoverShape]] = {}
    if table.cover is None:
        return out
    for i, ring in enumerate(table.ring):
        if ring.cover:
            shape = _shape(ring, table.cover, f"{path}: ring[{i}] {ring.name!r}", body_of)
            out.setdefault(ring.link, []).append(shape)
    if table.cover.body and len(out) > 1:
        raise RobotError(
            f"{path}: [cover] body is one link's, but rings sit on {', '.join(out)}; leave `body` "
            "and `visual` out, and the covers are made"
        )
    return out


def _shape(ring: RingTable, c: CoverTable, where: str, body_of: BodyOf | None) -> CoverShape:
    axis, start, _ = ring_axes(ring, where)
    inner = c.inner_radius_m
    if inner is None:
        assert body_of is not None
        inner = PLAY + link_radius(ring, c, where, axis, body_of(ring.link))
    least = inner + WALL + c.floor_m
    if ring.radius_m < least:
        raise RobotError(
            f"{where}: radius_m = {ring.radius_m:g} leaves no room for a cover round a bore of "
            f"{inner:.4f} m; give at least {least:.4f}, or cover = false"
        )
    room = int(np.pi * (ring.radius_m - c.floor_m) / c.window_half_m[0])
    if ring.count > room:
        raise RobotError(
            f"{where}: {ring.count} windows do not fit round a ring of {ring.radius_m:g} m; give "
            f"at most {room}, a larger radius_m, or cover = false"
        )
    return CoverShape(
        centre=ring.centre_m,
        axis=_point(ring.axis, axis),
        start=_point(ring.start, start),
        lens=ring.radius_m,
        windows=ring.count,
        tilt=ring.tilt_deg,
        inner=inner,
        foot_radius=c.foot_radius_m or inner + SLOPE,
        foot_half_width=c.foot_half_width_m,
        land_half_width=c.land_half_width_m,
        rim=c.rim_m,
        floor=c.floor_m,
        window_half=c.window_half_m,
    )


def link_radius(ring: RingTable, c: CoverTable, where: str, axis: Array, body: BodyMesh) -> float:
    """The link's radius round the ring's axis [m], the largest over the width of a cover.

    Raises `RobotError`, which begins with `where`, where the link is not round there.
    """
    centre, widest = np.array(ring.centre_m), 0.0
    for aside in c.foot_half_width_m * np.linspace(-1.0, 1.0, CUTS):
        reach = outline(body, centre + aside * axis, axis, within=ring.radius_m)
        if np.isnan(reach).any():
            missing = int(np.isnan(reach).sum())
            raise RobotError(
                f"{where}: its link's surface does not go all round within radius_m = "
                f"{ring.radius_m:g} at {1e3 * aside:+.0f} mm along the axis ({missing} of {BINS} "
                "directions are open or beyond); move the ring, give [cover] inner_radius_m, or "
                "this ring cover = false"
            )
        if np.ptp(reach) > OFF * reach.max():
            raise RobotError(
                f"{where}: its link is not round about the ring's axis at {1e3 * aside:+.0f} mm "
                f"along it (radius {reach.min():.4f} to {reach.max():.4f} m); mend centre_m and "
                "axis, give [cover] inner_radius_m, or this ring cover = false"
            )
        widest = max(widest, float(reach.max()))
    return widest


def _named(c: CoverTable | None, path: Path) -> tuple[Path, Path] | None:
    """Modelled meshes that a layout names, beside it."""
    if c is None or c.body is None:
        return None
    body = path.parent / c.body
    visual = path.parent / c.visual if c.visual else body
    if not visual.is_file():
        raise RobotError(f"{visual}: the covers' visual mesh is missing; mend `visual`")
    return body, visual


def _made(shapes: list[CoverShape]) -> tuple[Path, Path]:
    """Body and visual mesh of covers, from the cache folder or made now."""

    def make(folder: Path) -> None:
        # the library of solids is loaded only when there is something to make
        from app.robot.cover_solid import write_covers

        write_covers(shapes, folder / "body.stl", folder / "visual.glb")

    folder = cached_folder("covers", _digest(shapes), make)
    return folder / "body.stl", folder / "visual.glb"


def _digest(shapes: list[CoverShape]) -> str:
    """Of all that the meshes follow from: the shapes, and what makes solids of them."""
    sha = hashlib.blake2b(digest_size=12)
    for module in ("cover_solid.py", "solids.py"):
        sha.update((Path(__file__).parent / module).read_bytes())
    sha.update(json.dumps([version("manifold3d"), shapes]).encode())
    return sha.hexdigest()


def _point(written: Point, unit: Array) -> Point:
    """A direction; one that is written as a unit vector stays as it is to the last digit."""
    if np.abs(np.array(written) - unit).max() < 1e-7:
        return written
    x, y, z = unit.tolist()
    return x, y, z
