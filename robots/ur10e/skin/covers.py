"""The printed covers of `forearm-rings.toml` beside this file, as mesh files.

    make robot

Writes `meshes/visual/skin_cover.glb` and `meshes/body/skin_cover.stl` in the link's frame, in
metres. Other layouts need no script: their covers are made when they are loaded.
"""

from __future__ import annotations

from pathlib import Path

from app.robot.cover_solid import write_covers
from app.robot.covers import shapes_of
from app.robot.layout import read_layout

HERE = Path(__file__).parent
LAYOUT = HERE / "forearm-rings.toml"
MESHES = HERE.parent / "meshes"


def main(meshes: Path = MESHES, layout: Path = LAYOUT) -> None:
    """Write the covers' meshes into the folders `visual` and `body` of `meshes`."""
    ((_, shapes),) = shapes_of(read_layout(layout), layout).items()
    size, faces = write_covers(
        shapes, meshes / "body/skin_cover.stl", meshes / "visual/skin_cover.glb"
    )
    print(f"{'skin_cover':20} visual {size / 1024:6.0f} KiB   body {faces:5} faces")


if __name__ == "__main__":
    main()
