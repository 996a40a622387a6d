"""The skin's printed covers: rings around the forearm's tube with a window over every sensor.

    pip install numpy scikit-image manifold3d trimesh
    python robots/ur10e/skin/covers.py

Reads where the rings are from `forearm-rings.toml` beside this file and writes
`meshes/visual/skin_cover.glb` and `meshes/body/skin_cover.stl` in the link's frame, in metres.
A sensor looks out of a recess that opens at 45 degrees, which clears its 65 degree diagonal field
of view; its lens is 1 mm above the recess's floor. Numbers are millimetres.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np
from manifold3d import Manifold

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

from model import BODY, VISUAL, Detail, Materials, Part, frame, lathe, write_body, write_visual  # noqa: E402

RINGS = HERE / "forearm-rings.toml"
MESHES = HERE.parent / "meshes"

INNER = 43.2  # half a millimetre of play round the tube
OUTER = 2.0  # how far the cover stands out beyond the lenses
FLOOR = 1.0  # how far a recess's floor lies below the lenses
LAND = 12.0  # half width of the cover's widest part
FOOT = 23.0  # half width at the tube
FOOT_RADIUS = 45.5
WINDOW = (5.0, 4.0)  # half sizes of a recess's floor, round the tube and along it
CHIP = (3.2, 1.5, 0.5)  # half sizes of a VL53L8CX and its height above the floor

MATERIALS: Materials = {
    "print": ((66, 71, 78), 0.0, 0.7),
    "chip": ((14, 15, 18), 0.1, 0.25),
}


def window(lens: float) -> Manifold:
    """A recess under a lens at distance `lens` along u, flaring outward at 45 degrees."""
    points = []
    for rise in (0.0, 10.0):
        v, w = WINDOW[0] + rise, WINDOW[1] + rise
        points += [(lens - FLOOR + rise, a * v, b * w) for a in (-1, 1) for b in (-1, 1)]
    return Manifold.hull_points(np.array(points))


def chip(lens: float) -> Manifold:
    """The sensor on the recess's floor; its lens is the point `lens` just above it."""
    v, w, height = CHIP
    floor = lens - FLOOR
    return Manifold.cube((height + 1, 2 * v, 2 * w)).translate((floor - 1, -v, -w))


def cover(lens: float, count: int, detail: Detail) -> list[Part]:
    """One ring in its own frame: w along the tube, the first sensor along u."""
    rim = lens + OUTER
    profile = [(-FOOT, FOOT_RADIUS), (-LAND - 1, rim - 1), (-LAND, rim)]
    profile += [(-w, r) for w, r in reversed(profile)]
    body = lathe(profile, detail) - lathe([(-FOOT - 1, INNER), (FOOT + 1, INNER)], detail)
    turns = [(0, 0, 360 * k / count) for k in range(count)]
    for turn in turns:
        body -= window(lens).rotate(turn)
    parts = [Part("print", body)]
    if detail.ornaments:
        parts += [Part("chip", chip(lens).rotate(turn)) for turn in turns]
    return parts


def covers(detail: Detail) -> list[Part]:
    """All rings of the layout, in their link's frame."""
    parts = []
    for ring in tomllib.loads(RINGS.read_text())["ring"]:
        place = frame(1e3 * np.array(ring["centre_m"]), ring["start"], ring["axis"])
        for part in cover(1e3 * ring["radius_m"], ring["count"], detail):
            parts.append(Part(part.material, part.solid, None, place))
    return parts


def main() -> None:
    size = write_visual(covers(VISUAL), MESHES / "visual/skin_cover.glb", MATERIALS)
    faces = write_body(covers(BODY), MESHES / "body/skin_cover.stl")
    print(f"{'skin_cover':20} visual {size / 1024:6.0f} KiB   body {faces:5} faces")


if __name__ == "__main__":
    main()
