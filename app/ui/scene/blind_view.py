"""The cones of the sensors that cannot tell what is before them: space that is not watched.

They hang on their links and are sent anew only when another sensor cannot tell than before, which
is seldom. What neighbours look into of a cone, and how far, is not drawn.
"""

import numpy as np
import viser

from app.messages import Snapshot
from app.perception.unable import SEEING
from app.ui.colours import ALARM
from app.ui.engine import Engine
from app.ui.scene.poses import wxyz
from app.ui.scene.robot_view import alike, horn
from app.ui.scene.switch import Sign, Switch

LENGTH = 0.36  # [m] that is drawn: what is farther away does not slow the arm
OPACITY = 0.25


class BlindView:
    """One batch of cones for each link and field of view."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        self._server, self._sensors = server, engine.skin.sensors
        self.cones: list[viser.BatchedMeshHandle] = []
        self._shown: tuple[int, ...] = ()
        self._on = True

    def update(self, snapshot: Snapshot) -> None:
        unseeing = ~np.isin(snapshot.unable, SEEING)
        blind = tuple(np.flatnonzero(unseeing).tolist()) if self._on else ()
        if blind == self._shown:
            return
        self._shown = blind
        for cone in self.cones:
            cone.remove()
        self.cones = [
            self._batch(f"/robot/{link}/blind-{i + 1}", mine, *horn(view, LENGTH))
            for link, views in alike(self._sensors, blind).items()
            for i, (view, mine) in enumerate(views.items())
        ]

    def switches(self) -> list[Switch]:
        return [
            Switch(
                "Unwatched", self._on, self._set, "what sensors should see and cannot", Sign(ALARM)
            )
        ]

    def _set(self, on: bool) -> None:
        self._on = on

    def _batch(
        self, name: str, mine: list[int], vertices: np.ndarray, faces: np.ndarray
    ) -> viser.BatchedMeshHandle:
        poses = np.array([self._sensors[k].T_link_sensor for k in mine])
        return self._server.scene.add_batched_meshes_simple(
            name,
            vertices=vertices,
            faces=faces,
            batched_wxyzs=wxyz(poses),
            batched_positions=poses[:, :3, 3],
            batched_colors=np.tile(np.array(ALARM, dtype=np.uint8), (len(mine), 1)),
            opacity=OPACITY,
            lod="off",
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )
