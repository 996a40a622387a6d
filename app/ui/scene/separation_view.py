"""The protective separation distance as a ring around the point that comes nearest.

Drawn level with the floor, in the radius that speed and separation ask for at the measured speeds
of the nearest pair: a person inside it is nearer than the model allows. A model, not a certified
function.
"""

import numpy as np
import viser

from app.messages import Snapshot
from app.ui.colours import ALARM, GREY

CORNERS = 64


class SeparationView:
    """One ring, shown while the model is in use and something is in sight."""

    def __init__(self, server: viser.ViserServer) -> None:
        turn = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
        corners = np.stack((np.cos(turn), np.sin(turn), 0.0 * turn), axis=1)
        self._unit = np.stack((corners[:-1], corners[1:]), axis=1)
        self._broken = False
        self.ring = server.scene.add_line_segments(
            "/separation", self._unit.astype(np.float32), GREY, visible=False
        )

    def update(self, snapshot: Snapshot) -> None:
        pairs, radius = snapshot.pairs, snapshot.command.protective
        shown = radius > 0.0 and pairs.closest >= 0
        if shown:
            self.ring.points = (radius * self._unit).astype(np.float32)
            self.ring.position = pairs.on_robot[pairs.closest]
            broken = bool(pairs.minimum < radius)
            if broken != self._broken:
                self._broken = broken
                colour = np.array(ALARM if broken else GREY, dtype=np.uint8)
                self.ring.colors = np.broadcast_to(colour, self._unit.shape).copy()
        self.ring.visible = shown
