"""The skin's printed covers: rings around the forearm's tube with a window over every sensor.

    make robot

Reads where the rings are and how large their covers, `[[ring]]` and `[cover]`, from
`forearm-rings.toml` beside this file and writes `meshes/visual/skin_cover.glb` and
`meshes/body/skin_cover.stl` in the link's frame, in metres.
A sensor looks out of a recess that opens at 45 degrees, which clears its 65 degree diagonal field
of view; its lens is 1 mm above the recess's floor. Numbers are millimetres.
"""

from __future__ import annotations

import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from manifold3d import Manifold

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

from model import BODY, VISUAL, Detail, Materials, Part, frame, lathe, write_body, write_visual  # noqa: E402

RINGS = HERE / "forearm-rings.toml"
MESHES = HERE.parent / "meshes"

CHIP = (3.2, 1.5, 0.5)  # half sizes of a VL53L8CX and its height above the floor

MATERIALS: Materials = {
    "print": ((66, 71, 78), 0.0, 0.7),
    "chip": ((14, 15, 18), 0.1, 0.25),
}


@dataclass(frozen=True)
class Cover:
    """The layout's `[cover]`, in mm; see CoverTable in app/robot/skin.py."""

    inner_radius: float
    foot_radius: float
    foot_half_width: float
    land_half_width: float
    rim: float
    floor: float
    window_half: tuple[float, float]


def read_cover(table: dict[str, Any]) -> Cover:
    """Metres of the layout into millimetres."""
    mm = {key.removesuffix("_m"): 1e3 * np.array(value) for key, value in table.items()}
    return Cover(**{k: tuple(v.tolist()) if v.ndim else float(v) for k, v in mm.items()})


def window(lens: float, size: Cover) -> Manifold:
    """A recess under a lens at distance `lens` along u, flaring outward at 45 degrees."""
    points = []
    for rise in (0.0, 10.0):
        v, w = size.window_half[0] + rise, size.window_half[1] + rise
        points += [(lens - size.floor + rise, a * v, b * w) for a in (-1, 1) for b in (-1, 1)]
    return Manifold.hull_points(np.array(points))


def chip(lens: float, size: Cover) -> Manifold:
    """The sensor on the recess's floor; its lens is the point `lens` just above it."""
    v, w, height = CHIP
    floor = lens - size.floor
    return Manifold.cube((height + 1, 2 * v, 2 * w)).translate((floor - 1, -v, -w))


def cover(lens: float, count: int, size: Cover, detail: Detail) -> list[Part]:
    """One ring in its own frame: w along the tube, the first sensor along u."""
    rim, foot, land = lens + size.rim, size.foot_half_width, size.land_half_width
    profile = [(-foot, size.foot_radius), (-land - 1, rim - 1), (-land, rim)]
    profile += [(-w, r) for w, r in reversed(profile)]
    bore = [(-foot - 1, size.inner_radius), (foot + 1, size.inner_radius)]
    body = lathe(profile, detail) - lathe(bore, detail)
    turns = [(0, 0, 360 * k / count) for k in range(count)]
    for turn in turns:
        body -= window(lens, size).rotate(turn)
    parts = [Part("print", body)]
    if detail.ornaments:
        parts += [Part("chip", chip(lens, size).rotate(turn)) for turn in turns]
    return parts


def covers(detail: Detail) -> list[Part]:
    """All rings of the layout, in their link's frame."""
    parts = []
    layout = tomllib.loads(RINGS.read_text())
    size = read_cover(layout["cover"])
    for ring in layout["ring"]:
        place = frame(1e3 * np.array(ring["centre_m"]), ring["start"], ring["axis"])
        for part in cover(1e3 * ring["radius_m"], ring["count"], size, detail):
            parts.append(Part(part.material, part.solid, None, place))
    return parts


def main(meshes: Path = MESHES) -> None:
    """Write the covers' meshes into the folders `visual` and `body` of `meshes`."""
    size = write_visual(covers(VISUAL), meshes / "visual/skin_cover.glb", MATERIALS)
    faces = write_body(covers(BODY), meshes / "body/skin_cover.stl")
    print(f"{'skin_cover':20} visual {size / 1024:6.0f} KiB   body {faces:5} faces")


if __name__ == "__main__":
    main()
