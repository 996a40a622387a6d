"""The ghost: another controller's arm, translucent, where it would be now."""

import viser

from app.messages import Snapshot
from app.ui.colours import GHOST
from app.ui.engine import Engine
from app.ui.scene.poses import Nodes
from app.ui.scene.switch import Switch

OPACITY = 0.3


class GhostView:
    """Built at its first snapshot, since most runs have none."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        self._scene, self._robot = server.scene, engine.robot
        self._links: list[viser.MeshHandle] = []
        self._nodes = Nodes(())
        self._shown = True

    def update(self, snapshot: Snapshot) -> None:
        ghost = snapshot.ghost
        if ghost is None:
            for link in self._links:
                link.visible = False
            return
        if not self._links:
            self._links = [
                self._scene.add_mesh_simple(
                    f"/ghost/{name}", body.vertices, body.faces, color=GHOST, opacity=OPACITY,
                    cast_shadow=False, receive_shadow=False, visible=self._shown,
                )
                for name, body in zip(self._robot.links, self._robot.bodies, strict=True)
            ]  # fmt: skip
            self._nodes = Nodes(self._links)
        self._nodes.show(ghost.T_base_link)

    def switches(self) -> list[Switch]:
        return [Switch("Ghost", True, self._show, "a second controller, see --ghost")]

    def _show(self, on: bool) -> None:
        self._shown = on
        for link in self._links:
            link.visible = on
