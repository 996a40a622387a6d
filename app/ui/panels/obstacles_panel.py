"""Bodies put into the simulated world by hand: add, choose, move by numbers, take out."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import viser

from app.actions import Action, AddObstacle, MoveObstacle, RemoveObstacle
from app.messages import Array, Snapshot
from app.timing import Clock
from app.ui.engine import Engine
from app.ui.pacing import Every, HandsOff
from app.ui.panels.assign import assign

AHEAD, BESIDE = 0.6, 0.65  # [m] in front of the tool; beside the middle of the arm
LEVEL = np.array([1.0, 1.0, 0.0])
SIZES = {"smaller": 1.0 / 1.25, "larger": 1.25}
SMALLEST, LARGEST = 0.01, 2.0  # [m]
HOW = (
    "Drag a body in the scene to move it; with **Shift** it keeps its height. "
    "The arm only knows what its skin sees of it."
)
NOT_OFFERED = "Bodies and people can be put before **simulated sensors** only: these are real."
NOBODY = "(none)"
Shapes = Mapping[str, Mapping[str, Any]]  # name on the page to a shape table of a scene file
SHAPES: Shapes = {
    "Box": {"kind": "box", "size_m": [0.2, 0.2, 0.2]},
    "Sphere": {"kind": "sphere", "radius_m": 0.12},
    "Capsule": {"kind": "capsule", "radius_m": 0.07, "length_m": 0.4},
    "Panel": {"kind": "panel", "size_m": [0.6, 0.6], "thickness_m": 0.02},
}


class ObstaclesPanel:
    """One list of movable bodies, shared by all windows."""

    def __init__(
        self, server: viser.ViserServer, engine: Engine, clock: Clock, shapes: Shapes = SHAPES
    ) -> None:
        gui = server.gui
        self._shapes = shapes
        self._engine, self._hands, self._pace = engine, HandsOff(clock), Every(0.1)
        self._names: tuple[str, ...] = ()
        self._added: dict[str, Mapping[str, Any]] = {}  # shapes of what was added here
        self._snapshot: Snapshot | None = None
        some = engine.editable
        self.add = gui.add_button_group(
            "Add", tuple(shapes), visible=some,
            hint="beside the arm, as you see it; then drag it with the mouse",
        )  # fmt: skip
        self.chosen = gui.add_dropdown(
            "Obstacle", (NOBODY,), visible=some, hint="or click it in the scene"
        )
        self.position = gui.add_vector3(
            "Position [mm]", (0.0, 0.0, 0.0), step=10.0, disabled=True, visible=some,
            hint="x, y, z from the base",
        )  # fmt: skip
        self.size = gui.add_button_group(
            "Size", tuple(SIZES), visible=some, hint="of a body that was added here"
        )
        self.delete = gui.add_button(
            "Delete it", color="gray", icon=viser.Icon.TRASH, disabled=True, visible=some
        )
        gui.add_markdown(HOW if some else NOT_OFFERED)

        @self.add.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            self._add(event.target.value, eye_of(event.client))

        @self.size.on_click
        async def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            self._resize(SIZES[event.target.value])

        @self.delete.on_click
        async def _(_: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            engine.post(RemoveObstacle(self.chosen.value))

        @self.position.on_update
        async def _(event: viser.GuiEvent[viser.GuiVector3Handle]) -> None:
            self._move(event)

    def select(self, name: str) -> None:
        """Choose the body `name`, as a click in the scene does."""
        if name in self._names:
            assign(self.chosen, name)

    def update(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        if not self._pace.due(snapshot.stamp):
            return
        names = tuple(p.view.name for p in snapshot.world if p.view.movable)
        if names != self._names:
            added = [n for n in names if n not in self._names]
            first = not self._names
            self._names = names
            self.chosen.options = names or (NOBODY,)
            if added and not first:
                assign(self.chosen, added[-1])
            self.position.disabled = self.delete.disabled = not names
        if self._hands.free:
            T = self._pose(self.chosen.value)
            if T is not None:
                x, y, z = np.round(1000.0 * T[:3, 3])
                assign(self.position, (float(x), float(y), float(z)))

    def _add(self, label: str, eye: Array | None) -> None:
        if self._snapshot is None:
            return
        taken = {p.view.name for p in self._snapshot.world}
        name = next(n for i in range(1, len(taken) + 2) if (n := f"{label} {i}") not in taken)
        self._added[name] = self._shapes[label]
        for action in placed(name, self._shapes[label], self._snapshot, eye):
            self._engine.post(action)

    def _resize(self, factor: float) -> None:
        """Put a larger or smaller body of the same kind into the place of the chosen one."""
        name, T = self.chosen.value, self._pose(self.chosen.value)
        if T is None or name not in self._added:
            return
        self._added[name] = shape = resized(self._added[name], factor)
        x, y, z = T[:3, 3].tolist()
        self._engine.post(RemoveObstacle(name))
        self._engine.post(AddObstacle(name, dict(shape), (x, y, z)))
        self._engine.post(MoveObstacle(name, T))

    def _move(self, event: viser.GuiEvent[viser.GuiVector3Handle]) -> None:
        T = self._pose(self.chosen.value)
        if event.client_id is None or T is None:  # assigned by the page, or already gone
            return
        self._hands.touch()
        moved = T.copy()
        moved[:3, 3] = np.array(event.target.value) / 1000.0
        self._engine.post(MoveObstacle(self.chosen.value, moved))

    def _pose(self, name: str) -> Array | None:
        world = self._snapshot.world if self._snapshot is not None else ()
        return next((p.T_base_body for p in world if p.view.name == name), None)


def eye_of(client: viser.ClientHandle | None) -> Array | None:
    """(3,) [m] from where a page looks, base frame; None while that is not known."""
    if client is None or client.camera.update_timestamp == 0.0:
        return None
    return np.asarray(client.camera.position)


def resized(shape: Mapping[str, Any], factor: float) -> dict[str, Any]:
    """The shape with every length of it times `factor`, within `SMALLEST` and `LARGEST`."""

    def times(value: Any) -> Any:
        if isinstance(value, list | tuple):
            return [times(v) for v in value]
        return float(np.clip(round(value * factor, 4), SMALLEST, LARGEST))

    return {k: times(v) if k.endswith("_m") else v for k, v in shape.items()}


def placed(
    name: str, shape: Mapping[str, Any], snapshot: Snapshot, eye: Array | None = None
) -> list[Action]:
    """Put the body beside the arm as it is seen from `eye` (3,) [m], where nothing stands yet; with
    no eye in front of the tool. A panel stands upright.

    Forward is where the tool looks, if that is not mostly up or down, else away from the base.
    """
    forward = snapshot.T_base_tool[:3, 2] * LEVEL
    if np.linalg.norm(forward) < 0.5:
        forward = snapshot.T_base_tool[:3, 3] * LEVEL
    spot, ahead = snapshot.T_base_tool[:3, 3], AHEAD
    if eye is not None:
        spot, ahead = snapshot.T_base_link[:, :3, 3].mean(axis=0), BESIDE
        forward = np.cross((spot - eye) * LEVEL, [0.0, 0.0, 1.0])
    length = np.linalg.norm(forward)
    forward = forward / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])
    side = np.cross([0.0, 0.0, 1.0], forward)
    spot = spot + ahead * forward
    spot[2] = max(spot[2], 0.3)
    others = [p.T_base_body[:3, 3] for p in snapshot.world]
    for k in (0, 1, -1, 2, -2, 3, -3):
        here = spot + 0.35 * k * side
        if all(np.linalg.norm(here - o) > 0.3 for o in others):
            spot = here
            break
    out: list[Action] = [AddObstacle(name, dict(shape), (spot[0], spot[1], spot[2]))]
    if shape["kind"] == "panel":  # lies flat as built: turn its thin axis towards the arm
        T = np.eye(4)
        T[:3, 0], T[:3, 1], T[:3, 2], T[:3, 3] = side, [0.0, 0.0, 1.0], forward, spot
        out.append(MoveObstacle(name, T))
    return out
