"""Points that are remembered though no sensor sees them now, apart from what is seen."""

import numpy as np
import viser

from app.messages import Snapshot
from app.ui.colours import REMEMBERED
from app.ui.pacing import Every
from app.ui.scene.switch import Sign, Switch

PERIOD = 0.2  # [s]: 48 kB are too much for every frame
MOST = 4096  # points drawn; a changed count would make the browser allocate anew


class MemoryView:
    """One cloud of fixed size; what is not needed lies on the first point."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._on, self._pace = True, Every(PERIOD)
        self._cloud = server.scene.add_point_cloud(
            "/memory",
            np.zeros((MOST, 3), dtype=np.float32),
            REMEMBERED,
            point_size=0.005,
            point_shape="circle",
            precision="float32",
            visible=False,
        )

    def update(self, snapshot: Snapshot) -> None:
        if not self._pace.due(snapshot.stamp):
            return
        points = snapshot.memory
        shown = self._on and len(points) > 0
        if shown:
            thin = points[:: -(-len(points) // MOST)]
            drawn = np.repeat(thin[:1], MOST, axis=0)
            drawn[: len(thin)] = thin
            self._cloud.points = drawn.astype(np.float32)
        self._cloud.visible = shown

    def switches(self) -> list[Switch]:
        words = "points that left the field of view and still count (setting: memory)"
        return [
            Switch("Remembered points", self._on, self._set, words, Sign(REMEMBERED, hollow=True))
        ]

    def _set(self, on: bool) -> None:
        self._on = on
