"""What became of one zone, in words: what it saw, why that was believed or not, what would change
it. Pure: everything comes out of one cloud and the facts of arm, skin and place.

The threshold of the self filter is (see `app.perception.uncertainty.threshold`)

    eps = near + SIGMAS * sqrt(V + position^2)

so the mounting error at which it would be some other length w follows from two such lines:

    position'^2 = position^2 + ((w - near)^2 - (eps - near)^2) / SIGMAS^2
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from app.cell.parts import LEARNED, Cell
from app.messages import Array, Cloud, Verdict
from app.perception.uncertainty import SIGMAS
from app.robot.model import Robot
from app.robot.skin import Skin
from app.ui.words import link_words

HELD = 0.5  # [m] farther away than this a mounting error is no sensible question


class Words(NamedTuple):
    """short: some words for the scene.   said: what became of it.   change: what would alter it."""

    short: str
    said: str
    change: str


@dataclass(frozen=True, eq=False, slots=True)
class Zone:
    """One zone of sensor k of a cloud, and what is known of it.

    distance: [m] as the sensor reports it, NaN without one.   age: [s] of its frame.
    dirty:    is the sensor's window taken for dirty?
    """

    cloud: Cloud
    slot: int
    k: int
    distance: float
    age: float
    dirty: bool
    skin: Skin
    robot: Robot
    cell: Cell

    @property
    def body(self) -> str:
        """The link in the zone's way, as a person calls it; empty if none is."""
        link = int(self.cloud.link[self.slot])
        return f"the {link_words(self.robot.links[link])}" if link >= 0 else ""

    @property
    def gap(self) -> float:
        """[m] by which the point lies before that link."""
        return float(self.cloud.gap[self.slot])

    @property
    def eps(self) -> float:
        """[m] threshold that `gap` was compared with, NaN where it was not."""
        return float(self.cloud.eps[self.slot])


def explain(zone: Zone) -> Words:
    """The words of the zone's verdict."""
    return _HOW[Verdict(int(zone.cloud.verdict[zone.slot]))](zone)


def title(zone: Zone) -> str:
    """Which zone it is and how far it sees: `ring2-07, row 3, column 5: 31.0 cm`."""
    sensor = zone.skin.sensors[zone.k]
    row, column = divmod(zone.slot - int(zone.skin.first[zone.k]), sensor.type.columns)
    far = f"{100.0 * zone.distance:.1f} cm" if np.isfinite(zone.distance) else "no distance"
    return f"{sensor.name}, row {row + 1}, column {column + 1}: {far}"


def distances(cloud: Cloud, T_base_link: Array, skin: Skin) -> Array:
    """(S,) [m] distances as their sensors report them, NaN where there is none.

    From the points and where the lenses are now (L, 4, 4): of an arm that moves they are off by
    its way since the frame.
    """
    T = T_base_link[skin.link]
    lens = T[:, :3, 3] + np.einsum("kij,kj->ki", T[:, :3, :3], skin.origin)
    far = np.linalg.norm(cloud.points - lens[skin.sensor_of], axis=1)
    return np.asarray(far / np.linalg.norm(skin.reach, axis=1))


def mounting_for(zone: Zone, wanted: float) -> float:
    """[m] 1 sigma of the lens's place at which the zone's threshold would be `wanted` [m]; NaN
    where no sigma makes it so, as where the threshold was measured."""
    k, error = zone.k, zone.skin.sensors[zone.k].type.error
    if np.isfinite(zone.robot.eps[int(zone.cloud.link[zone.slot])]).any():
        return float("nan")
    fades = 1.0 - zone.distance / error.near_offset_below_m
    near = error.near_offset_m * min(max(fades, 0.0), 1.0)
    square = float(zone.skin.doubt.position[k]) ** 2
    square += ((wanted - near) ** 2 - (zone.eps - near) ** 2) / SIGMAS**2
    return float(np.sqrt(square)) if square >= 0.0 and wanted > near else float("nan")


def part_at(cell: Cell, point: Array) -> tuple[str, float]:
    """The part of the known cell that holds a point (3,) [m], and how deep [m] it lies in it; an
    empty name where none of its boxes and planes does."""
    best = ("", -np.inf)
    for box in cell.boxes:
        here = box.T_base_box[:3, :3].T @ (point - box.T_base_box[:3, 3])
        best = max(best, (box.name, float((box.size / 2.0 - np.abs(here)).min())), key=_depth)
    for plane in cell.planes:
        T = plane.T_base_plane
        best = max(best, (plane.name, float(T[:3, 2] @ (T[:3, 3] - point))), key=_depth)
    return best if best[1] >= 0.0 else ("", 0.0)


def _depth(part: tuple[str, float]) -> float:
    return part[1]


def _mm(metres: float) -> str:
    return f"{1000.0 * metres:.0f} mm"


# --- verdict by verdict -------------------------------------------------------------------


def _kept(z: Zone) -> Words:
    if not z.body or not np.isfinite(z.gap):
        return Words(
            "an obstacle",
            "An obstacle: no part of the arm is in this zone's way.",
            "If it always stands there, learn the background: then it counts as the known cell.",
        )
    if z.gap < 0.0:
        return Words(
            "an obstacle",
            f"An obstacle by the published rules, though it lies {_mm(-z.gap)} behind {z.body}.",
            "With another controller than `paper` such points are thrown away.",
        )
    said = f"An obstacle: {_mm(z.gap)} before {z.body}, the threshold is {_mm(z.eps)}."
    change = f"{_mm(z.gap - z.eps)} farther away it would count as the arm itself."
    sigma, now = mounting_for(z, z.gap), float(z.skin.doubt.position[z.k])
    if sigma <= HELD:
        change += (
            f" So it would if the sensor's place were known to {_mm(sigma)} only; now it is known "
            f"to {_mm(now)}."
        )
    return Words(f"an obstacle, {_mm(z.gap)} before {z.body}", said, change)


def _self(z: Zone) -> Words:
    if not z.body or (not abs(z.gap) <= max(z.eps, 0.0) and z.gap > 0.0):
        return _not_modelled(z)
    side = "before" if z.gap >= 0.0 else "behind"
    said = (
        f"The arm itself: it hit {z.body} {_mm(abs(z.gap))} {side} the mesh, the threshold is "
        f"{_mm(z.eps)}."
    )
    change = f"{_mm(z.eps - z.gap)} nearer to the lens it would be an obstacle."
    now = float(z.skin.doubt.position[z.k])
    if np.isfinite(z.robot.eps[int(z.cloud.link[z.slot])]).any():
        change += " This link's threshold was measured (flinch calibrate filter)."
    elif z.gap > 0.0:
        sigma = mounting_for(z, z.gap)
        change += (
            f" So it would if the sensor's place were known to {_mm(sigma)}; now it is known to "
            f"{_mm(now)}."
            if np.isfinite(sigma)
            else " No better mounting alone would do that: noise may carry it so far."
        )
        change += f" If the mounting is off by {_mm(max(z.gap, now))}, it may be an obstacle today."
    return Words(f"the arm itself: {z.body}, {_mm(abs(z.gap))} {side} its mesh", said, change)


def _not_modelled(z: Zone) -> Words:
    if z.dirty:
        return Words(
            "the arm itself, by a dirty window",
            "Taken for the arm itself: thin, before the arm's outline, and the window is dirty.",
            "Clean the window: it counts as clean half a minute later.",
        )
    on = f" on {z.body}" if z.body else ""
    return Words(
        f"a hose or a cable{on}",
        f"Taken for a hose or a cable{on}: thin, and inside the hull of the arm.",
        "Wider than 7 cm, or reaching out of the hull, it would be an obstacle.",
    )


def _behind(z: Zone) -> Words:
    return Words(
        f"behind {z.body}",
        f"Thrown away: {_mm(-z.gap)} behind the surface of {z.body}, where nothing can be seen.",
        "The light took a way round, or joints or mounting are not where they are believed: "
        "`flinch calibrate mounts` finds the latter.",
    )


def _static(z: Zone) -> Words:
    name, deep = part_at(z.cell, z.cloud.points[z.slot])
    if not name:
        return Words(
            f"the known cell: {LEARNED}",
            "The known cell: learned background, or a mixture of its edge and the arm's.",
            "Forget the background, and what stands there is an obstacle again.",
        )
    return Words(
        f"the known cell: {name}",
        f"The known cell: {_mm(deep)} inside {name!r}.",
        f"{_mm(deep)} out of it, it would be an obstacle; the cell file says how large it is.",
    )


def _bad_status(z: Zone) -> Words:
    codes = ", ".join(map(str, z.skin.sensors[z.k].type.status.trusted))
    return Words(
        "not trusted by the sensor",
        f"Thrown away: the sensor itself does not trust it; its status is none of {codes}.",
        "Sunlight, a dirty window, or a target at the end of the range do that.",
    )


def _no_target(z: Zone) -> Words:
    kind = z.skin.sensors[z.k].type
    return Words(
        "nothing there",
        "Nothing came back: empty space, or something black.",
        f"A grey thing is found up to {kind.detection.grey.dark_m:g} m, in bright light up to "
        f"{kind.detection.grey.bright_m:g} m.",
    )


def _out_of_range(z: Zone) -> Words:
    kind = z.skin.sensors[z.k].type
    near = z.distance < kind.least_m
    side, limit = ("nearer", kind.least_m) if near else ("farther", kind.most_m)
    return Words(
        f"too {'near' if near else 'far'}",
        f"Thrown away: {side} than the {100.0 * limit:g} cm that are believed of a {kind.title}.",
        "The type's file of the sensor holds this limit.",
    )


def _stale(z: Zone) -> Words:
    oldest = z.skin.sensors[z.k].type.oldest
    return Words(
        "too old",
        f"Too old: its frame is {z.age:.1f} s old, and counts for {oldest:.1f} s.",
        "The sensor's next frame renews it; a port that is unplugged stands below.",
    )


def _empty(z: Zone) -> Words:
    return Words("no frame yet", "No frame has come from this sensor yet.", "Its first frame.")


def _ghost(z: Zone) -> Words:
    return Words(
        "not yet believed",
        "Waits: one zone has seen it in one frame, nearer than what was there before.",
        "A neighbouring zone, or the next frame, that shows it makes it an obstacle.",
    )


def _contact(z: Zone) -> Words:
    return Words(
        "at the lens",
        "Something at the lens, nearer than can be measured: avoided.",
        "It is held until it is seen to leave.",
    )


_HOW: dict[Verdict, Callable[[Zone], Words]] = {
    Verdict.KEPT: _kept,
    Verdict.SELF: _self,
    Verdict.BEHIND: _behind,
    Verdict.STATIC: _static,
    Verdict.BAD_STATUS: _bad_status,
    Verdict.NO_TARGET: _no_target,
    Verdict.OUT_OF_RANGE: _out_of_range,
    Verdict.STALE: _stale,
    Verdict.EMPTY: _empty,
    Verdict.GHOST: _ghost,
    Verdict.CONTACT: _contact,
}
