"""Where rings of sensors, with printable covers, may go on an arm.

A ring sits where a link is round for the width of a cover. A candidate is a ring as a layout has
it, so that what is chosen can be written, printed and loaded as it is.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.errors import RobotError, options
from app.messages import Array
from app.robot.covers import link_radius
from app.robot.meshes import BodyMesh
from app.robot.model import Robot
from app.robot.roundness import Stretch, across, circle, round_stretch
from app.robot.skin_file import RingTable
from app.robot.tables import CoverTable

LENS = 0.0173  # [m] of a lens above its link: room for a sensor's board in a cover
WIDTH = 0.046  # [m] of a cover along its link
SPACING = 0.04  # [m] between two places, about
COUNTS = (4, 5, 6, 8, 10)  # sensors of a ring
TILTS = (-35.0, 0.0, 35.0)  # [deg] along the link


class KeepOut(NamedTuple):
    """A part of a link's round stretch where nothing may go: [m] from its end by the joint."""

    link: str
    low: float
    high: float


class Place(NamedTuple):
    """Where a ring may go: [m] along the link's stretch, link frame, radius of its lenses."""

    link: str
    along: float
    centre: Array
    axis: Array
    radius: float


def parse_keep_out(text: str) -> KeepOut:
    """LINK, or LINK:FROM:TO in metres along its round stretch, as a person writes it."""
    link, *rest = text.split(":")
    try:
        low, high = map(float, rest) if rest else (0.0, np.inf)
    except ValueError:
        low, high = np.nan, np.nan
    if not (link and 0.0 <= low < high):
        raise RobotError(
            f"keep-out {text!r}; give LINK, or LINK:FROM:TO with metres, 0 <= FROM < TO"
        )
    return KeepOut(link, low, high)


@lru_cache(maxsize=2)
def round_links(robot: Robot) -> dict[str, Stretch]:
    """The links that move and are round for the width of a cover, from their joint outwards."""
    out = {}
    for name, body, moved in zip(robot.links, robot.bodies, robot.supports, strict=True):
        found = round_stretch(body) if moved.any() else None
        if found is not None and found.length >= WIDTH:
            near = found.low @ found.low <= found.high @ found.high  # its frame is at the joint
            out[name] = found if near else Stretch(found.high, found.low, found.radius)
    return out


def places(
    robot: Robot, links: Sequence[str] = (), keep_out: Sequence[KeepOut] = ()
) -> list[Place]:
    """Every place for a ring on these links, all round ones without any, `SPACING` apart.

    RobotError for a link that has none, by name.
    """
    known = round_links(robot)
    for name in (*links, *(k.link for k in keep_out)):
        if name not in known:
            raise RobotError(
                f"no ring fits round link {name!r} of {robot.name}; {options(name, known)}"
            )
    out = []
    for name, stretch in known.items():
        if links and name not in links:
            continue
        body = robot.bodies[robot.link_index(name)]
        room = stretch.length - WIDTH
        for along in WIDTH / 2.0 + np.linspace(0.0, room, max(int(room / SPACING), 0) + 1):
            near = stretch.low + along * stretch.axis
            cut = circle(body, near, stretch.axis)
            barred = any(
                k.low < along + WIDTH / 2.0 and along - WIDTH / 2.0 < k.high
                for k in keep_out if k.link == name
            )  # fmt: skip
            if cut is not None and not barred:
                radius = max(stretch.radius, cut.radius) + LENS
                at = Place(name, float(along), cut.centre, stretch.axis, radius)
                out += [at] if _wears_a_cover(at, body) else []
    if not out:
        raise RobotError(f"{robot.name} has no place for a ring; give other --links or --keep-out")
    return out


def _wears_a_cover(at: Place, body: BodyMesh) -> bool:
    (ring,) = rings_at(at, (1,), (0.0,))[:1]
    try:
        link_radius(ring, CoverTable(), "", at.axis, body)
    except RobotError:  # it is not round for the whole width of a cover
        return False
    return True


def rings_at(place: Place, counts: Sequence[int], tilts: Sequence[float]) -> list[RingTable]:
    """The rings that may go there, each at two turns: half a pitch apart."""
    u, v = across(place.axis)
    out = []
    for count in counts:
        for tilt in tilts:
            for half in (0, 1):
                turn = np.pi / count * half
                start = np.cos(turn) * u + np.sin(turn) * v
                name = f"{place.link.removesuffix('_link')}-{1e3 * place.along:.0f}"
                out.append(
                    RingTable(
                        name=name, link=place.link, centre_m=_vector(place.centre, 4),
                        axis=_vector(place.axis, 8), start=_vector(start, 8),
                        radius_m=round(place.radius, 4), count=count, tilt_deg=tilt,
                    )
                )  # fmt: skip
    return out


def clashes(at: Sequence[Place]) -> NDArray[np.bool_]:
    """(n, n) bool: do the covers of rings at two of these places overlap? A ring's own does."""
    link = np.array([p.link for p in at])
    along = np.array([p.along for p in at])
    close = np.abs(along[:, None] - along) < WIDTH - 1e-9
    return np.asarray((link[:, None] == link) & close)


def _vector(v: Array, digits: int) -> tuple[float, float, float]:
    x, y, z = (np.round(v, digits) + 0.0).tolist()
    return x, y, z
