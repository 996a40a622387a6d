"""What hardly ever changes: light, ground and where the eye starts."""

import numpy as np
import viser

from app.cell.outline import bottom_of
from app.cell.parts import Cell
from app.messages import BodyPose, Snapshot
from app.ui.scene.switch import Switch

GAP = 0.002  # [m] below what stands on the ground, so that the two do not flicker


class Stage:
    """Built once; only the ground sinks below the lowest thing of the world, or of the cell."""

    def __init__(self, server: viser.ViserServer, cell: Cell) -> None:
        scene = server.scene
        self._scene = scene
        scene.configure_environment_map("studio", environment_intensity=0.6)
        top, bottom = np.array([206, 216, 228]), np.array([250, 251, 252])
        sky = np.linspace(top, bottom, 256).astype(np.uint8)
        scene.set_background_image(np.repeat(sky[:, None], 8, axis=1), format="png")
        self._grid = scene.add_grid(
            "/ground",
            width=6.0,
            height=6.0,
            cell_size=0.1,
            cell_thickness=0.6,
            cell_color=(225, 228, 232),
            section_size=0.5,
            section_color=(188, 194, 202),
            plane_color=(246, 247, 249),
            plane_opacity=1.0,
            shadow_opacity=0.15,
            fade_distance=9.0,
            position=(0.0, 0.0, min(0.0, bottom_of(cell)) - GAP),
        )
        self._bottom = bottom_of(cell)  # where nothing is simulated
        self._known: frozenset[str] = frozenset()
        camera = server.initial_camera
        camera.position, camera.look_at = (1.55, -1.95, 1.25), (0.28, 0.0, 0.36)
        camera.fov = 0.75

    def update(self, snapshot: Snapshot) -> None:
        names = frozenset(p.view.name for p in snapshot.world if not p.view.movable)
        if names != self._known:  # a dragged body does not move the ground
            self._known = names
            still = [p for p in snapshot.world if not p.view.movable]
            heights = map(lowest, still) if still else [self._bottom]
            self._grid.position = (0.0, 0.0, min(0.0, *heights) - GAP)

    def switches(self) -> list[Switch]:
        ground = Switch("Ground", True, lambda on: setattr(self._grid, "visible", on))
        words = "off: faster without a graphics card"
        return [ground, Switch("Shadows", True, self.cast_shadows, words)]

    def cast_shadows(self, on: bool) -> None:
        """Shadows tell how high a thing hovers, but are drawn anew for every picture."""
        self._scene.configure_default_lights(cast_shadow=on)


def lowest(body: BodyPose) -> float:
    """Height [m] of the body's lowest vertex, base frame."""
    z = body.view.vertices @ body.T_base_body[2, :3] + body.T_base_body[2, 3]
    return float(z.min())
