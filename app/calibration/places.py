"""Which sensor sits where, and how its image is turned: found before anything is fitted.

At rest every place of the layout should report something; what a stream really reports fits one
place, turned and mirrored in one way, to centimetres, and the others to decimetres. The cost of
each combination is the mean misfit, cut off where it says nothing more; the assignment of streams
to places with the least sum is taken. A place as laid out is believed until another one is clearly
better: neighbours in a ring see much the same.
"""

from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from app.calibration.placing import Zones, placed_of, rows_of, stance_of
from app.calibration.planes import Plane
from app.calibration.sight import Surroundings
from app.calibration.views import Path, Views
from app.messages import Array
from app.robot.model import Robot
from app.robot.skin import Sensor, Skin, build_skin, zone_centres

Rotation = Literal[0, 90, 180, 270]
ROTATIONS: tuple[Rotation, ...] = (0, 90, 180, 270)
SETTINGS = tuple(product(ROTATIONS, (False, True)))  # rotation_deg, mirrored
RESTS = 40  # views of each sensor that are compared
CUT = 0.08  # [m] a misfit says nothing more
FEWEST = 60  # zones that must be comparable
CLEARLY = 0.6  # another place or turn is believed when its misfit is less than this share


@dataclass(frozen=True, slots=True)
class Place:
    """Where a sensor sits: the index of the place in the layout, and its settings there."""

    place: int
    rotation_deg: Rotation
    mirrored: bool


def as_laid_out(skin: Skin) -> tuple[Place, ...]:
    """Every sensor in its own place."""
    return tuple(
        Place(k, _rotation(s), s.mirrored) for k, s in enumerate(skin.sensors)
    )  # fmt: skip


def skin_in_places(robot: Robot, skin: Skin, places: tuple[Place, ...]) -> Skin:
    """The skin with its sensors there, under their own names."""
    sensors = tuple(
        replace(
            skin.sensors[p.place], name=s.name, rotation_deg=p.rotation_deg, mirrored=p.mirrored
        )
        for s, p in zip(skin.sensors, places, strict=True)
    )
    new = build_skin(skin.title, sensors, robot)
    return replace(new, ranges=skin.ranges, doubt=skin.doubt, late=skin.late)


def find_places(
    robot: Robot, skin: Skin, planes: tuple[Plane, ...], views: Views, path: Path
) -> tuple[Place, ...]:
    """The place of each sensor."""
    views = _some_rests(views, skin.count)
    straight = tuple(replace(p, rotation_deg=0, mirrored=False) for p in as_laid_out(skin))
    expected, q = _expected(robot, skin_in_places(robot, skin, straight), planes, views, path)
    measured = _measured(views, q, skin.count)
    cost = np.full((skin.count, skin.count, len(SETTINGS)), CUT)
    for j, there in enumerate(skin.sensors):
        for o, (rotation, mirrored) in enumerate(SETTINGS):
            zone = _order(replace(there, rotation_deg=rotation, mirrored=mirrored))
            if zone is None:
                continue
            said = expected[:, j, zone]
            same = [i for i, s in enumerate(skin.sensors) if s.type == there.type]
            cost[same, j, o] = _misfit(measured[:, same, : len(zone)], said)
    return _assigned(skin, cost)


def _assigned(skin: Skin, cost: Array) -> tuple[Place, ...]:
    """The least sum of costs (K, K, settings): stream, place, setting."""
    usual = as_laid_out(skin)
    for p in usual:
        o = SETTINGS.index((p.rotation_deg, p.mirrored))
        cost[:, p.place, o] *= (1.0 + CLEARLY) / 2  # most sensors of a skin are turned alike
        cost[p.place, p.place, o] *= 2 * CLEARLY / (1.0 + CLEARLY)
    stream, place = linear_sum_assignment(cost.min(axis=2))
    out = list(usual)
    for i, j in zip(stream, place, strict=True):
        rotation, mirrored = SETTINGS[int(cost[i, j].argmin())]
        out[i] = Place(int(j), rotation, mirrored)
    return tuple(out)


def _rotation(sensor: Sensor) -> Rotation:
    return ROTATIONS[ROTATIONS.index(sensor.rotation_deg)]


def _some_rests(views: Views, sensors: int) -> Views:
    """At most `RESTS` of the rests, evenly taken, for every sensor."""
    stamps = np.unique(views.stamp[~views.moving])
    if len(stamps) > RESTS:
        stamps = stamps[np.linspace(0, len(stamps) - 1, RESTS).astype(np.intp)]
    return views.of(~views.moving & np.isin(views.stamp, stamps))


def _expected(
    robot: Robot, skin: Skin, planes: tuple[Plane, ...], views: Views, path: Path
) -> tuple[Array, Array]:
    """(R, K, Z) what each place should report in each rest, NaN where unsure; stamps (R,)."""
    stamps, first = np.unique(views.stamp, return_index=True)
    K, Z = skin.count, views.report.shape[1]
    R = len(stamps)
    every = Views(
        np.tile(np.arange(K), R), np.repeat(stamps, K), np.zeros(R * K, dtype=bool),
        np.repeat(views.q[first], K, axis=0), np.zeros((R * K, Z)), np.ones((R * K, Z)),
    )  # fmt: skip
    stance = stance_of(robot, every, path, 0.0, np.zeros((robot.n, 6)))
    T = np.array([s.T_link_sensor for s in skin.sensors])
    placed = placed_of(robot, skin, every, stance, T)
    around = Surroundings(robot, skin, planes)
    T_plane = np.array([p.T_base_plane for p in planes])
    rows = rows_of(every, stance, placed, around, Zones(skin, Z), T_plane)
    look = placed.T_base_sensor[rows.view]
    way = np.einsum("nij,nj->ni", look[:, :3, :3], rows.u)
    lens = (rows.normal * look[:, :3, 3]).sum(axis=1)
    out = np.full((R * K, Z), np.nan)
    out[rows.view, rows.zone] = rows.length * (rows.height - lens) / (rows.normal * way).sum(axis=1)
    return out.reshape(R, K, Z), stamps


def _measured(views: Views, stamps: Array, sensors: int) -> Array:
    """(R, K, Z) what each stream reported, NaN where nothing."""
    out = np.full((len(stamps), sensors, views.report.shape[1]), np.nan)
    out[np.searchsorted(stamps, views.stamp), views.sensor] = views.report
    return out


def _order(sensor: Sensor) -> NDArray[np.intp] | None:
    """(n,) which zone of the sensor mounted straight looks where its n-th zone does; None where
    such a turn fits no grid of its type."""
    straight = zone_centres(replace(sensor, rotation_deg=0, mirrored=False))
    away = np.linalg.norm(zone_centres(sensor)[:, None] - straight[None], axis=2)
    nearest = away.argmin(axis=1)
    return nearest if away[np.arange(len(nearest)), nearest].max() < 1e-6 else None


def _misfit(measured: Array, said: Array) -> Array:
    """(m,) [m] of streams (R, m, n) with what a place should report (R, n)."""
    off = np.abs(measured - said[:, None])
    known = np.isfinite(off)
    count = known.sum(axis=(0, 2))
    total = np.where(known, np.minimum(off, CUT), 0.0).sum(axis=(0, 2))
    return np.where(count >= FEWEST, total / np.maximum(count, 1), CUT)
