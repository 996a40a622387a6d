"""The closest pairs as arrows from the world's point to the robot's point.

The thick arrow is the pair that the avoidance looks at, coloured by the activation, with the
distance beside it. The thin ones are the closest pairs of the other links.
"""

import numpy as np
import viser
from numpy.typing import NDArray

from app.messages import Array, Pairs, Snapshot
from app.ui.colours import CALM, DARK, RGB, activation_colour
from app.ui.engine import Engine
from app.ui.scene.poses import place
from app.ui.scene.switch import Switch
from app.ui.words import link_words

LEEWAY = 0.005  # [m] that the label may be off the arrow's end
Segments = NDArray[np.float32]


class PairView:
    """Arrows and a label."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        scene = server.scene
        self._names = [link_words(link) for link in engine.robot.links]
        self._others_on = False
        self._colour: RGB = CALM
        self.arrow = scene.add_arrows(
            "/pair/closest",
            np.zeros((1, 2, 3)),
            CALM,
            shaft_radius=0.006,
            head_radius=0.017,
            head_length=0.04,
            visible=False,
        )
        self.label = scene.add_label(
            "/pair/distance", "", anchor="bottom-center", font_screen_scale=1.25, visible=False
        )
        self.others = scene.add_arrows(
            "/pair/links",
            np.zeros((len(self._names), 2, 3)),
            DARK,
            shaft_radius=0.002,
            head_radius=0.007,
            head_length=0.02,
            visible=False,
        )

    def update(self, snapshot: Snapshot) -> None:
        self._closest(snapshot.pairs, snapshot.command.activation)
        segments = link_segments(snapshot.body) if self._others_on else None
        if segments is not None:
            self.others.points = segments
        self.others.visible = segments is not None

    def switches(self) -> list[Switch]:
        return [Switch("Link arrows", False, self._show_others, "closest pair of each body link")]

    def _closest(self, pairs: Pairs, activation: float) -> None:
        seen = pairs.closest >= 0
        if seen:
            i = pairs.closest
            world, robot = pairs.on_world[i], pairs.on_robot[i]
            normal = pairs.normal[i]
            self.arrow.points = visible_segments(world[None], robot[None], normal[None])
            if np.abs(self.label.position - world).max() > LEEWAY:
                place(self.label, world)
            self._say(self._names[int(pairs.link[i])], float(pairs.distance[i]), activation)
        self.arrow.visible = self.label.visible = seen

    def _say(self, name: str, distance: float, activation: float) -> None:
        self.label.text = f"{100.0 * distance:.0f} cm · {name}"
        colour = activation_colour(activation)
        if colour != self._colour:
            self._colour = colour
            self.arrow.colors = np.array(colour, dtype=np.uint8)

    def _show_others(self, on: bool) -> None:
        self._others_on = on


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
