"""The simulated world: what is really there, which the arm only knows through its skin.

A movable body is dragged with the mouse, in the plane of the screen; with Shift it slides at
its own height. The mesh itself follows the snapshots, so every window sees the same.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser

from app.actions import MoveObstacle
from app.messages import Array, BodyView, Snapshot
from app.ui.engine import Engine
from app.ui.scene.poses import wxyz
from app.ui.scene.switch import Switch

REACH = 3.0  # [m] from the base: farther than any arm here; keeps a slip of the mouse in sight


@dataclass
class _Body:
    view: BodyView
    handle: viser.MeshHandle
    T_base_body: Array


@dataclass(frozen=True)
class _Grab:
    """Where a drag began: the body's pose and the point under the mouse, base frame."""

    T_base_body: Array
    point: Array


class WorldView:
    """Meshes of the bodies; rebuilt only when a body's `BodyView` is another object."""

    def __init__(
        self, server: viser.ViserServer, engine: Engine, on_select: Callable[[str], None]
    ) -> None:
        self._server, self._engine, self._on_select = server, engine, on_select
        self._bodies: dict[str, _Body] = {}
        self._grabs: dict[tuple[int, str], _Grab] = {}
        self._root = server.scene.add_frame("/world", show_axes=False)

    def update(self, snapshot: Snapshot) -> None:
        here = {p.view.name: p for p in snapshot.world}
        for name, body in list(self._bodies.items()):
            if name not in here or here[name].view is not body.view:
                body.handle.remove()
                del self._bodies[name]
        for name, placed in here.items():
            if name not in self._bodies:
                self._bodies[name] = self._add(placed.view, placed.T_base_body)
            body = self._bodies[name]
            body.T_base_body = placed.T_base_body
            body.handle.position = placed.T_base_body[:3, 3]
            body.handle.wxyz = wxyz(placed.T_base_body)

    def switches(self) -> list[Switch]:
        return [
            Switch(
                "Obstacles",
                True,
                lambda on: setattr(self._root, "visible", on),
                "hide them to see what the skin alone knows",
            )
        ]

    def drag(self, name: str, event: viser.SceneNodeDragEvent[viser.MeshHandle]) -> None:
        """A window drags the body `name`."""
        key = (event.client_id, name)
        if event.phase == "start" and name in self._bodies:
            self._on_select(name)
            pose = self._bodies[name].T_base_body
            self._grabs[key] = _Grab(pose, np.asarray(event.start_position))
        grab = self._grabs.get(key)
        if grab is None:
            return
        if event.phase == "end":
            del self._grabs[key]
            return
        target = np.asarray(event.end_position)
        if event.modifier == "shift":
            target = at_height(event.client.camera.position, target, grab.point)
        moved = grab.T_base_body.copy()
        moved[:3, 3] += target - grab.point
        if np.linalg.norm(moved[:3, 3]) < REACH:
            self._engine.post(MoveObstacle(name, moved))

    def let_go(self, window: int) -> None:
        """The window drags nothing any more, whatever it says."""
        self._grabs = {key: grab for key, grab in self._grabs.items() if key[0] != window}

    def _add(self, view: BodyView, T_base_body: Array) -> _Body:
        handle = self._server.scene.add_mesh_simple(
            f"/world/{view.name}",
            view.vertices,
            view.faces,
            color=view.colour,
            flat_shading=True,
            side="double",
            wxyz=wxyz(T_base_body),
            position=T_base_body[:3, 3],
        )
        if view.movable:
            name = view.name

            @handle.on_drag("left")
            @handle.on_drag("left", modifier="shift")
            async def _(event: viser.SceneNodeDragEvent[viser.MeshHandle]) -> None:
                self.drag(name, event)

            @handle.on_click
            async def _(event: viser.SceneNodePointerEvent[viser.MeshHandle]) -> None:
                self._on_select(name)

        return _Body(view, handle, T_base_body)


def at_height(eye: Array, target: Array, point: Array) -> Array:
    """Where the ray from `eye` through `target` meets the level plane through `point`.

    A ray that is nearly level meets it nowhere sensible; then `point` itself is returned.
    """
    ray = target - eye
    if abs(ray[2]) < 0.05 * np.linalg.norm(ray):
        return point
    share = (point[2] - eye[2]) / ray[2]
    return eye + share * ray if share > 0.0 else point
