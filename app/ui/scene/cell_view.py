"""The known cell: boxes and planes as they are in the file, learned cubes, and their preview.

What is drawn here is no obstacle to the perception, and the arm stays out of it.
"""

import numpy as np
import viser

from app.cell.learned import EDGE
from app.cell.outline import CORNERS, FACES, outline
from app.cell.parts import Cell, HalfSpace
from app.messages import Array, Snapshot
from app.ui.colours import GREY, KNOWN, PREVIEW, RGB
from app.ui.scene.poses import wxyz
from app.ui.scene.switch import Sign, Switch

THIN = 0.002  # [m] of a plane's patch


class CellView:
    """Boxes and planes are drawn once, cubes anew when others are known or previewed."""

    def __init__(self, server: viser.ViserServer, cell: Cell) -> None:
        self._scene = server.scene
        self._root = server.scene.add_frame("/cell", show_axes=False)
        if cell.boxes:
            lines = np.concatenate([outline(box) for box in cell.boxes])
            server.scene.add_line_segments("/cell/boxes", lines, GREY, thickness=0.004)
        for plane in cell.planes:
            self._add_patch(plane)
        self.known = _Cubes(server, "/cell/learned", KNOWN, 0.25)
        self.preview = _Cubes(server, "/preview", PREVIEW, 0.5)  # seen whatever is switched off

    def update(self, snapshot: Snapshot) -> None:
        self.known.show(snapshot.background.known)
        self.preview.show(snapshot.background.preview)

    def switches(self) -> list[Switch]:
        words = "what is known and static: no obstacle, but the arm stays out of it"
        return [
            Switch(
                "Cell",
                True,
                lambda on: setattr(self._root, "visible", on),
                words,
                Sign(GREY, hollow=True),
            )
        ]

    def _add_patch(self, plane: HalfSpace) -> None:
        self._scene.add_box(
            f"/cell/planes/{plane.name}",
            GREY,
            (*plane.size, THIN),
            opacity=0.15,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
            wxyz=wxyz(plane.T_base_plane),
            position=plane.T_base_plane[:3, 3],
        )


class _Cubes:
    """Cubes of one colour; `handle` is None while there are none."""

    def __init__(self, server: viser.ViserServer, name: str, colour: RGB, opacity: float) -> None:
        self._scene, self._name, self._colour, self._opacity = server.scene, name, colour, opacity
        self._shown: Array = np.empty((0, 3))
        self.handle: viser.BatchedMeshHandle | None = None

    def show(self, centres: Array) -> None:
        """Centres (n, 3) [m]; another object is looked at, the same one is not."""
        if centres is self._shown:
            return
        self._shown = centres
        if self.handle is not None:
            self.handle.remove()
            self.handle = None
        if len(centres):
            self.handle = self._scene.add_batched_meshes_simple(
                self._name,
                CORNERS * EDGE,
                FACES,
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(centres), 1)),
                batched_positions=centres,
                batched_colors=self._colour,
                opacity=self._opacity,
                lod="off",
                flat_shading=True,
                cast_shadow=False,
                receive_shadow=False,
            )
