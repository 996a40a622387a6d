"""What hardly ever changes: light, ground and where the eye starts."""

import numpy as np
import viser

from app.cell.outline import bottom_of
from app.messages import Array, BodyPose, Snapshot
from app.robot.model import Robot
from app.ui.engine import Engine
from app.ui.scene.switch import Switch

GAP = 0.002  # [m] below what stands on the ground, so that the two do not flicker
FROM = np.array([0.60, -0.72, 0.36])  # the direction from which the arm is looked at
FOV = 0.75  # [rad] from the upper to the lower edge
ROOM = 1.25  # the picture holds so much more than the arm: what comes near it
UPRIGHT = 1.6  # [-] a picture that is higher than wide stands back so far at most
LEVEL = 0.08  # share of the arm's size by which it is drawn above the middle: the legend is below


class Stage:
    """Built once; only the ground sinks below the lowest thing of the world, or of the cell."""

    def __init__(self, server: viser.ViserServer, engine: Engine) -> None:
        scene, cell = server.scene, engine.cell
        self._scene = scene
        scene.configure_environment_map("studio", environment_intensity=0.6)
        top, bottom = np.array([198, 210, 224]), np.array([240, 243, 246])
        sky = np.linspace(top, bottom, 256).astype(np.uint8)
        scene.set_background_image(np.repeat(sky[:, None], 8, axis=1), format="png")
        self._grid = scene.add_grid(
            "/ground",
            width=6.0,
            height=6.0,
            cell_size=0.1,
            cell_thickness=0.6,
            cell_color=(208, 213, 219),
            section_size=0.5,
            section_color=(160, 168, 178),
            plane_color=(229, 232, 236),
            plane_opacity=1.0,
            shadow_opacity=0.3,
            fade_distance=9.0,
            position=(0.0, 0.0, min(0.0, bottom_of(cell)) - GAP),
        )
        self._bottom = bottom_of(cell)  # where nothing is simulated
        self._known: frozenset[str] = frozenset()
        self._look_at, self._away = framed(engine.robot)
        camera = server.initial_camera
        camera.position = tuple(self._look_at + self._away)
        camera.look_at, camera.fov = tuple(self._look_at), FOV
        server.on_client_connect(self._stand_back)

    async def _stand_back(self, client: viser.ClientHandle) -> None:
        """A picture that is higher than wide, as on a phone, shows the arm whole as well."""
        camera = client.camera
        share = camera.image_height / max(camera.image_width, 1)
        if share > 1.0:
            camera.position = self._look_at + min(share, UPRIGHT) * self._away
            camera.look_at = self._look_at

    def update(self, snapshot: Snapshot) -> None:
        names = frozenset(p.view.name for p in snapshot.world if not p.view.movable)
        if names != self._known:  # a dragged body does not move the ground
            self._known = names
            still = [p for p in snapshot.world if not p.view.movable]
            heights = map(lowest, still) if still else [self._bottom]
            self._grid.position = (0.0, 0.0, min(0.0, *heights) - GAP)

    def switches(self) -> list[Switch]:
        hint = "a grid of 10 cm, and what casts a shadow on it"
        ground = Switch("Ground", True, lambda on: setattr(self._grid, "visible", on), hint)
        words = "off: faster without a graphics card"
        return [ground, Switch("Shadows", True, self.cast_shadows, words)]

    def cast_shadows(self, on: bool) -> None:
        """Shadows tell how high a thing hovers, but are drawn anew for every picture."""
        self._scene.configure_default_lights(cast_shadow=on)


def lowest(body: BodyPose) -> float:
    """Height [m] of the body's lowest vertex, base frame."""
    z = body.view.vertices @ body.T_base_body[2, :3] + body.T_base_body[2, 3]
    return float(z.min())


def framed(robot: Robot) -> tuple[Array, Array]:
    """Where to look (3,) [m], and how far from there to stand (3,) [m]: all of the arm at home."""
    T = robot.posture(robot.home).T_base_link
    corners = np.concatenate(
        [b.vertices @ t[:3, :3].T + t[:3, 3] for b, t in zip(robot.bodies, T, strict=True)]
    )
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float(np.linalg.norm(high - low))
    middle = (low + high) / 2.0 - [0.0, 0.0, LEVEL * size]
    away = FROM / np.linalg.norm(FROM) * ROOM * size / 2.0 / np.tan(FOV / 2.0)
    return middle, away
