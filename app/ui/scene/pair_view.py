"""The closest pairs as arrows from the world's point to the robot's point.

The thick arrow is the closest pair that can give way, with the distance that the panel tells
beside it, in the panel's colour; the thin grey one the closest that cannot. The dark ones are the
closest pairs of all links.
"""

import numpy as np
import viser
from numpy.typing import NDArray

from app.messages import Array, Pairs, Snapshot
from app.near import Near
from app.ui.colours import CALM, DARK, FIXED, RGB
from app.ui.engine import Engine
from app.ui.reading import Reading
from app.ui.scene.poses import place
from app.ui.scene.switch import Sign, Switch
from app.ui.words import centimetres

LEEWAY = 0.005  # [m] that the label may be off the arrow's end
Segments = NDArray[np.float32]


class PairView:
    """Arrows and a label."""

    def __init__(self, server: viser.ViserServer, engine: Engine, reading: Reading) -> None:
        self._reading, self._anew = reading, -1
        self._others_on, self._on = False, True
        self._colour: RGB = CALM
        self.arrow = _arrows(server, "/pair/closest", 1, CALM, (0.006, 0.017, 0.04))
        self.fixed = _arrows(server, "/pair/fixed", 1, FIXED, (0.003, 0.009, 0.025))
        self.label = server.scene.add_label(
            "/pair/distance", "", anchor="bottom-center", font_screen_scale=1.25, visible=False
        )
        links = len(engine.robot.links)
        self.others = _arrows(server, "/pair/links", links, DARK, (0.002, 0.007, 0.02))

    def update(self, snapshot: Snapshot) -> None:
        near, read = snapshot.nearness, self._reading
        told = self._show(self.arrow, near.yields, read.yields)
        self._show(self.fixed, near.stays, read.stays)
        if told and read.anew != self._anew:
            self._anew = read.anew
            self._say(read.yields)
        self.label.visible = told
        segments = link_segments(snapshot.body) if self._others_on else None
        if segments is not None:
            self.others.points = segments
        self.others.visible = segments is not None

    def switches(self) -> list[Switch]:
        closest = "the closest point that can give way, and in grey the closest that cannot"
        return [
            Switch("Distance", True, self._show_closest, closest, Sign(CALM)),
            Switch("Link arrows", False, self._show_others, "closest pair of each body link"),
        ]

    def _show(self, arrow: viser.ArrowsHandle, now: Near, told: Near) -> bool:
        """Draw the pair as it is now, as long as it is the one that is told."""
        shown = self._on and told.seen
        if shown and now.link == told.link:
            arrow.points = visible_segments(
                now.on_world[None], now.on_robot[None], now.normal[None]
            )
        arrow.visible = shown
        return shown

    def _say(self, near: Near) -> None:
        self.label.text = f"{centimetres(near.distance)} · {self._reading.links[near.link]}"
        if np.abs(self.label.position - near.on_world).max() > LEEWAY:
            place(self.label, near.on_world)
        if self._reading.colour != self._colour:
            self._colour = self._reading.colour
            self.arrow.colors = np.array(self._colour, dtype=np.uint8)

    def _show_closest(self, on: bool) -> None:
        self._on = on

    def _show_others(self, on: bool) -> None:
        self._others_on = on


def _arrows(
    server: viser.ViserServer, name: str, count: int, colour: RGB, size: tuple[float, float, float]
) -> viser.ArrowsHandle:
    """Arrows of one colour; size: radius of the shaft, radius and length of the head [m]."""
    return server.scene.add_arrows(
        name, np.zeros((count, 2, 3)), colour, shaft_radius=size[0], head_radius=size[1],
        head_length=size[2], visible=False,
    )  # fmt: skip


def link_segments(body: Pairs) -> Segments | None:
    """(L, 2, 3) world to robot; links without a pair repeat the closest one; None if none has."""
    if body.closest < 0:
        return None
    mine = np.isfinite(body.distance)
    rows = np.where(mine, np.arange(len(mine)), body.closest)
    return visible_segments(body.on_world[rows], body.on_robot[rows], body.normal[rows])


def visible_segments(world: Array, robot: Array, normal: Array) -> Segments:
    """(m, 2, 3) arrows; one of no length has no direction to draw, so it gets a millimetre."""
    short = np.linalg.norm(robot - world, axis=1) < 1e-3
    ends = np.where(short[:, None], world + 1e-3 * normal, robot)
    return np.stack((world, ends), axis=1).astype(np.float32)
