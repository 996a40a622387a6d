"""An electric screwdriver, simplified: plate, housing, collar, bit and the plug of its cable.

    make robot

Writes `meshes/screwdriver.glb` and `.stl` beside this file, in the flange's frame (z out of the
flange), in metres. Numbers are millimetres; the bit's tip is the tool frame in
`screwdriver.toml`.
"""

from __future__ import annotations

from pathlib import Path

from manifold3d import Manifold

from app.robot.solids import (
    BODY,
    VISUAL,
    Detail,
    Materials,
    Part,
    lathe,
    write_body,
    write_visual,
)

HERE = Path(__file__).parent

PLATE = ((-0.2, 30.0), (0.0, 31.5), (11.0, 31.5), (12.0, 30.5))  # (z, radius), on the flange
HOUSING = ((10.0, 27.0), (13.0, 28.0), (118.0, 28.0), (124.0, 25.0))
COLLAR = ((123.0, 19.0), (125.0, 20.0), (140.0, 20.0), (156.0, 9.0), (160.0, 8.0))
BIT = ((158.0, 4.0), (194.0, 4.0), (200.0, 1.6))
PLUG = ((26.0, -9.0, 30.0), (18.0, 18.0, 26.0))  # corner and size, on the housing's side

MATERIALS: Materials = {
    "housing": ((44, 62, 80), 0.0, 0.5),
    "steel": ((170, 174, 178), 0.6, 0.35),
}


def screwdriver(detail: Detail) -> list[Part]:
    """The tool in the flange's frame."""
    corner, size = PLUG
    housing = lathe(HOUSING, detail) + Manifold.cube(size).translate(corner)
    steel = [Part("steel", lathe(profile, detail)) for profile in (PLATE, COLLAR, BIT)]
    return [Part("housing", housing), *steel]


def main(meshes: Path = HERE / "meshes") -> None:
    """Write both meshes into a folder."""
    size = write_visual(screwdriver(VISUAL), meshes / "screwdriver.glb", MATERIALS)
    faces = write_body(screwdriver(BODY), meshes / "screwdriver.stl")
    print(f"{'screwdriver':20} visual {size / 1024:6.0f} KiB   body {faces:5} faces")


if __name__ == "__main__":
    main()
