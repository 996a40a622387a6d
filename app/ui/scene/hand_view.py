"""The body in somebody's hand: how high it is, what it stands above, how far it is from the arm.

The distance is the true one, of the meshes: the skin may see less of it, and later.
"""

import numpy as np
import viser

from app.judge.truth import Hull, distance_between, surface
from app.messages import Array, BodyPose, BodyView, Snapshot
from app.ui.colours import DARK
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.scene.poses import place
from app.ui.scene.world_view import WorldView
from app.ui.words import link_words

PERIOD = 0.1  # [s]
RADIUS, SIDES = 0.09, 24  # [m] of the disc beneath it
OPACITY = 0.35
UP = np.array([0.0, 0.0, 1.0])


class HandView:
    """A line down to the plane of the base, a disc there, a label; only while a body is held."""

    def __init__(self, server: viser.ViserServer, engine: Engine, world: WorldView) -> None:
        self._robot, self._world, self._pace = engine.robot, world, Every(PERIOD)
        self._links: list[Hull] = []  # made when the first body is taken
        self._body: tuple[BodyView, Hull] | None = None
        self.label = server.scene.add_label(
            "/hand/distance", "", anchor="bottom-center", font_screen_scale=1.25, visible=False
        )
        self.line = server.scene.add_line_segments(
            "/hand/line", np.zeros((1, 2, 3)), DARK, thickness=0.004, visible=False
        )
        self.shadow = server.scene.add_mesh_simple(
            "/hand/shadow", *disc(), color=DARK, opacity=OPACITY, side="double",
            cast_shadow=False, receive_shadow=False, visible=False,
        )  # fmt: skip

    def update(self, snapshot: Snapshot) -> None:
        held = self._world.held
        body = next((p for p in snapshot.world if p.view.name in held), None)
        if body is None:
            if self.label.visible:
                self.label.visible = self.line.visible = self.shadow.visible = False
            return
        if self._pace.due(snapshot.stamp):
            self._show(body, snapshot.T_base_link)

    def _show(self, body: BodyPose, T_base_link: Array) -> None:
        centre = body.T_base_body[:3, 3]
        ground = centre * [1.0, 1.0, 0.0]
        k, distance = self._nearest(body, T_base_link)
        name = link_words(self._robot.links[k])
        self.label.text = f"{100.0 * max(distance, 0.0):.0f} cm to the {name}"
        top = (body.view.vertices @ body.T_base_body[:3, :3].T)[:, 2].max()
        place(self.label, centre + (top + 0.03) * UP)
        self.line.points = np.array([[centre, ground]], dtype=np.float32)
        place(self.shadow, ground + 0.002 * UP)
        self.label.visible = self.line.visible = self.shadow.visible = True

    def _nearest(self, body: BodyPose, T_base_link: Array) -> tuple[int, float]:
        """The link that is nearest to the body, and how far [m] it is from it."""
        if not self._links:
            self._links = [surface(b.vertices, b.faces) for b in self._robot.bodies]
        if self._body is None or self._body[0] is not body.view:
            self._body = (body.view, surface(body.view.vertices, body.view.faces))
        solid, T = self._body[1], body.T_base_body
        far = [
            distance_between(link, T_base_link[i], solid, T) for i, link in enumerate(self._links)
        ]
        k = int(np.argmin(far))
        return k, far[k]


def disc() -> tuple[Array, np.ndarray]:
    """Vertices (SIDES + 1, 3) [m] and faces of a flat disc about the z axis."""
    turn = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    rim = RADIUS * np.stack([np.cos(turn), np.sin(turn), np.zeros(SIDES)], axis=1)
    i = np.arange(SIDES)
    return np.vstack([np.zeros(3), rim]), np.stack(
        [np.zeros(SIDES, dtype=np.int64), i + 1, (i + 1) % SIDES + 1], axis=1
    )
