"""The simulated world: what is really there, which the arm only knows through its skin.

A movable body is dragged with the mouse, in the plane of the screen; with Shift it slides at
its own height. The mesh itself follows the snapshots, so every window sees the same. In a recording
nobody drags anything.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser

from app.actions import MoveObstacle
from app.messages import Array, BodyPose, BodyView, Snapshot
from app.ui.colours import BODY
from app.ui.engine import Engine
from app.ui.pacing import Every
from app.ui.scene.poses import Nodes, wxyz
from app.ui.scene.switch import Sign, Switch

PERIOD = 0.06  # [s] between two pictures of what nobody drags
REACH = 3.0  # [m] from the base: farther than any arm here; keeps a slip of the mouse in sight


@dataclass(frozen=True)
class _Grab:
    """Where a drag began: the body's pose and the point under the mouse, base frame."""

    T_base_body: Array
    point: Array


class WorldView:
    """Meshes of the bodies; rebuilt only when a body's `BodyView` is another object."""

    def __init__(
        self,
        server: viser.ViserServer,
        engine: Engine,
        on_select: Callable[[str], None] | None = None,
    ) -> None:
        """on_select: told which body a person takes; None: none can be taken."""
        self._server, self._engine, self._on_select = server, engine, on_select
        self._bodies: dict[str, tuple[BodyView, viser.MeshHandle]] = {}
        self._world: tuple[BodyPose, ...] = ()
        self._nodes, self._pace = Nodes(()), Every(PERIOD)
        self._grabs: dict[tuple[int, str], _Grab] = {}
        self._root = server.scene.add_frame("/world", show_axes=False)

    def update(self, snapshot: Snapshot) -> None:
        before, self._world = self._world, snapshot.world
        if [p.view for p in before] != [p.view for p in snapshot.world]:
            self._rebuild(snapshot.world)
        dragged = bool(self._grabs)
        if snapshot.world and (self._pace.due(snapshot.stamp) or dragged):
            self._nodes.show(np.array([p.T_base_body for p in snapshot.world]))

    @property
    def held(self) -> tuple[str, ...]:
        """Names of the bodies that somebody drags."""
        return tuple(name for _, name in self._grabs)

    def switches(self) -> list[Switch]:
        return [
            Switch(
                "Obstacles",
                True,
                lambda on: setattr(self._root, "visible", on),
                "hide them to see what the skin alone knows",
                Sign(BODY),
            )
        ]

    def drag(self, name: str, event: viser.SceneNodeDragEvent[viser.MeshHandle]) -> None:
        """A window drags the body `name`."""
        key = (event.client_id, name)
        pose = next((p.T_base_body for p in self._world if p.view.name == name), None)
        if event.phase == "start" and pose is not None:
            self._select(name)
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

    def _rebuild(self, world: tuple[BodyPose, ...]) -> None:
        """Take away what is gone or looks different, add what is new."""
        here = {p.view.name: p.view for p in world}
        for name, (view, handle) in list(self._bodies.items()):
            if here.get(name) is not view:
                handle.remove()
                del self._bodies[name]
        for p in world:
            if p.view.name not in self._bodies:
                self._bodies[p.view.name] = (p.view, self._add(p.view, p.T_base_body))
        self._nodes = Nodes([self._bodies[p.view.name][1] for p in world])

    def _add(self, view: BodyView, T_base_body: Array) -> viser.MeshHandle:
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
        if view.movable and self._on_select is not None:
            name = view.name

            @handle.on_drag("left")
            @handle.on_drag("left", modifier="shift")
            async def _(event: viser.SceneNodeDragEvent[viser.MeshHandle]) -> None:
                self.drag(name, event)

            @handle.on_click
            async def _(event: viser.SceneNodePointerEvent[viser.MeshHandle]) -> None:
                self._select(name)

        return handle

    def _select(self, name: str) -> None:
        if self._on_select is not None:
            self._on_select(name)


def at_height(eye: Array, target: Array, point: Array) -> Array:
    """Where the ray from `eye` through `target` meets the level plane through `point`.

    A ray that is nearly level meets it nowhere sensible; then `point` itself is returned.
    """
    ray = target - eye
    if abs(ray[2]) < 0.05 * np.linalg.norm(ray):
        return point
    share = (point[2] - eye[2]) / ray[2]
    return eye + share * ray if share > 0.0 else point
