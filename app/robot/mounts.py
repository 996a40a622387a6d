"""Where the sensors of a skin really sit: an overlay on its layout, and the file that keeps it.

A layout says where sensors were meant to sit. `flinch calibrate mounts` finds how far each is
off, and writes that beside it:

    version = 1
    robot = "ur10e"
    layout = "three rings of ten on the forearm"
    late_ms = 40.2           # a frame's light was sent so long before its stamp
    late_sigma_ms = 0.6

    [[sensor]]
    name = "ring1-01"
    place = "ring1-02"       # it sits where the layout has this one; left out: in its own place
    rotation_deg = 90        # as in a layout; left out: the layout's
    shift_mm = [1.2, -0.4, 0.3]
    turn_deg = [0.3, -0.1, 0.6]
    sigma_mm = 0.4           # one sigma of a component
    sigma_deg = 0.05
    zone_percent = [0.8, -1.2, 0.1]   # of the distance, to be added; one a zone
    zone_sigma_percent = 0.2
    unsure = "saw too little"

Shift and turn (a rotation vector) are in the frame of the sensor as laid out:

    T_link_sensor = T_link_laid_out [exp(turn), shift]
"""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from app.errors import RobotError, options
from app.messages import Array, freeze
from app.robot.doubt import Doubt
from app.robot.model import Robot
from app.robot.posture import rotation_matrix
from app.robot.ranges import RangeTable
from app.robot.skin import Sensor, Skin, build_skin
from app.toml import Name, NotNegative, Table, Vector, read_toml

VERSION = 1
NO_SHIFT: Vector = (0.0, 0.0, 0.0)
MAKE = "calibrate it with flinch calibrate mounts"
Percent = Annotated[float, Meta(ge=-20, le=20)]


class MountTable(Table, frozen=True, kw_only=True):
    """`[[sensor]]`: how one sensor sits otherwise than its layout says; see the module."""

    name: Name
    place: str = ""
    rotation_deg: Literal[0, 90, 180, 270] | None = None
    mirrored: bool | None = None
    shift_mm: Vector = NO_SHIFT
    turn_deg: Vector = NO_SHIFT
    sigma_mm: NotNegative
    sigma_deg: NotNegative
    zone_percent: tuple[Percent, ...] = ()
    zone_sigma_percent: NotNegative = 0.0
    unsure: str = ""


class MountsTable(Table, frozen=True, kw_only=True):
    """The file. late_ms: how much later than its light a frame's stamp is, of all sensors."""

    version: int = VERSION
    robot: Name
    layout: Name
    late_ms: float = 0.0
    late_sigma_ms: NotNegative
    sensor: tuple[MountTable, ...] = ()


def save_mounts(path: Path, mounts: MountsTable) -> None:
    """Write an overlay; RobotError where that cannot be done."""
    lines = [f"# {mounts.robot}, {mounts.layout}: written by flinch calibrate mounts"]
    lines += _lines(mounts)
    for m in mounts.sensor:
        lines += ["", "[[sensor]]", *_lines(m)]
    try:
        path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    except OSError as e:
        raise RobotError(f"{path}: cannot be written ({e.strerror}); give another file") from e


def load_mounts(path: Path) -> MountsTable:
    """Read an overlay; RobotError naming the file, the entry and the remedy."""
    version = read_toml(path, dict, RobotError).get("version", VERSION)
    if isinstance(version, int) and version > VERSION:
        raise RobotError(
            f"{path}: version = {version}, this Flinch reads {VERSION}; update it, or {MAKE} anew"
        )
    return read_toml(path, MountsTable, RobotError)


def with_mounts(skin: Skin, mounts: MountsTable, robot: Robot) -> Skin:
    """The skin as it is believed to sit; RobotError where the overlay is another skin's."""
    if (mounts.robot, mounts.layout) != (robot.name, skin.title):
        raise RobotError(
            f"these mounts are of {mounts.robot}, {mounts.layout!r}, not of {robot.name}, "
            f"{skin.title!r}; give the file of this skin, or {MAKE}"
        )
    names = [s.name for s in skin.sensors]
    for m in mounts.sensor:
        for name in (m.name, m.place or m.name):
            if name not in names:
                raise RobotError(
                    f"mounts: the skin has no sensor {name!r}; {options(name, names)}; mend the "
                    f"file, or {MAKE}"
                )
    of = {m.name: m for m in mounts.sensor}
    sensors = tuple(_mounted(skin, s, of.get(s.name)) for s in skin.sensors)
    _check_places(skin, of)
    new = build_skin(skin.title, sensors, robot)
    doubt = _doubt(skin, of, mounts.late_sigma_ms / 1e3)
    return replace(new, ranges=_ranges(skin, of), late=mounts.late_ms / 1e3, doubt=doubt)


def _lines(table: Table) -> list[str]:
    """The keys of a table that are given, but for the tables in it."""
    values = {key: getattr(table, key) for key in table.__struct_fields__ if key != "sensor"}
    # a number, a text, a truth value and a list are written in TOML as in JSON
    return [
        f"{key} = {json.dumps(value, ensure_ascii=False)}"
        for key, value in values.items()
        if value not in (None, "", ())
    ]


def _mounted(skin: Skin, sensor: Sensor, m: MountTable | None) -> Sensor:
    """One sensor with its corrections."""
    if m is None:
        return sensor
    there = skin.sensors[skin.index(m.place or m.name)]
    if there.type != sensor.type:
        raise RobotError(
            f"mounts: {m.name} cannot sit in the place of {there.name}: they are of different "
            f"types; mend `place`, or {MAKE}"
        )
    if len(m.zone_percent) not in (0, sensor.type.zones):
        raise RobotError(
            f"mounts: {m.name}: zone_percent has {len(m.zone_percent)} values, its type has "
            f"{sensor.type.zones} zones; mend the file, or {MAKE}"
        )
    return replace(
        there,
        name=sensor.name,
        T_link_sensor=moved(there.T_link_sensor, m),
        rotation_deg=there.rotation_deg if m.rotation_deg is None else m.rotation_deg,
        mirrored=there.mirrored if m.mirrored is None else m.mirrored,
    )


def moved(T_link_laid_out: Array, m: MountTable) -> Array:
    """T_link_sensor (4, 4) of a sensor that was laid out there."""
    shift = np.eye(4)
    shift[:3, :3] = rotation_matrix(np.radians(m.turn_deg))
    shift[:3, 3] = np.array(m.shift_mm) / 1e3
    return freeze(T_link_laid_out @ shift)


def _check_places(skin: Skin, of: dict[str, MountTable]) -> None:
    """No two sensors in one place."""
    taken: dict[str, str] = {}
    for s in skin.sensors:
        place = (of[s.name].place if s.name in of else "") or s.name
        if place in taken:
            raise RobotError(
                f"mounts: {taken[place]} and {s.name} both sit in the place of {place}; mend "
                f"`place`, or {MAKE}"
            )
        taken[place] = s.name


def _doubt(skin: Skin, of: dict[str, MountTable], late_sigma: float) -> Doubt:
    """What is known of the sensors that the overlay names, and of all stamps."""
    position, angle, share = (
        a.copy() for a in (skin.doubt.position, skin.doubt.angle, skin.doubt.share)
    )
    for k, s in enumerate(skin.sensors):
        if m := of.get(s.name):
            position[k], angle[k] = m.sigma_mm / 1e3, np.radians(m.sigma_deg)
            if m.zone_percent:
                share[k] = m.zone_sigma_percent / 100
    time = np.full(skin.count, late_sigma)
    return replace(
        skin.doubt, position=freeze(position), angle=freeze(angle), share=freeze(share),
        time=freeze(time),
    )  # fmt: skip


def _ranges(skin: Skin, of: dict[str, MountTable]) -> RangeTable | None:
    """The table of zones with the overlay's shares on top: a range is corrected by both."""
    shares = [_share(skin.sensors[k], of) for k in range(skin.count)]
    share = np.concatenate(shares)[:, None]
    if not share.any():
        return skin.ranges
    at, offset = np.array([1.0]), np.zeros((skin.slots, 1))
    if skin.ranges is not None:
        at, offset = skin.ranges.at, skin.ranges.offset
    return RangeTable(freeze(at), freeze((at + offset) * (1.0 + share) - at))


def _share(sensor: Sensor, of: dict[str, MountTable]) -> Array:
    percent: Sequence[float] = of[sensor.name].zone_percent if sensor.name in of else ()
    return np.array(percent) / 100 if percent else np.zeros(sensor.type.zones)
