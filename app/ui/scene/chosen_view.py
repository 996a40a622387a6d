"""What a person has clicked, in the scene: the cone of a sensor, and a zone's point with a word.

The cone hangs on its link and is made anew only when another sensor is chosen.
"""

import numpy as np
import viser

from app.cell.parts import Cell
from app.messages import Snapshot
from app.perception.unable import Unable
from app.ui.chosen import NOBODY, Chosen
from app.ui.colours import CHOSEN
from app.ui.engine import Engine
from app.ui.scene.cloud_view import CloudView
from app.ui.scene.coverage_view import CoverageView
from app.ui.scene.poses import place, wxyz
from app.ui.scene.robot_view import half_view, horn
from app.ui.scene.switch import Switch
from app.ui.verdicts import Zone, distances, explain

LENGTH = 0.4  # [m] of the cone: beyond, neighbours overlap anyway
OPACITY = 0.35
RADIUS = 0.014  # [m] of the ball at a point: a point is drawn with 8 mm


class ChosenView:
    """A cone, a ball, a label."""

    def __init__(self, server: viser.ViserServer, engine: Engine, chosen: Chosen) -> None:
        self._server, self._engine, self._chosen = server, engine, chosen
        self._cone: viser.MeshHandle | None = None
        self._drawn, self._on = NOBODY, True
        self.ball = server.scene.add_icosphere(
            "/chosen/point", RADIUS, CHOSEN, subdivisions=2, cast_shadow=False,
            receive_shadow=False, visible=False,
        )  # fmt: skip
        self.label = server.scene.add_label(
            "/chosen/words", "", anchor="bottom-left", visible=False
        )

    def update(self, snapshot: Snapshot) -> None:
        self._draw_cone(self._chosen.sensor if self._on else NOBODY)
        slot = self._chosen.slot if self._on else NOBODY
        point = snapshot.cloud.points[slot] if slot >= 0 else np.full(3, np.nan)
        seen = bool(np.isfinite(point).all())
        if seen:
            words = explain(zone_of(snapshot, slot, self._engine, self._engine.cell)).short
            if self.label.text != words:
                self.label.text = words
            if np.abs(self.ball.position - point).max() > RADIUS / 4:
                place(self.ball, point)
                place(self.label, point)
        self.ball.visible = self.label.visible = seen

    def switches(self) -> list[Switch]:
        return [Switch("Chosen sensor", True, self._set, "its cone, and the point you clicked")]

    def _set(self, on: bool) -> None:
        self._on = on

    def _draw_cone(self, k: int) -> None:
        if k == self._drawn:
            return
        self._drawn = k
        if self._cone is not None:
            self._cone.remove()
            self._cone = None
        if k == NOBODY:
            return
        sensor = self._engine.skin.sensors[k]
        vertices, faces = horn(half_view(sensor), LENGTH)
        self._cone = self._server.scene.add_mesh_simple(
            f"/robot/{sensor.link}/chosen", vertices, faces, color=CHOSEN, opacity=OPACITY,
            side="double", flat_shading=True, cast_shadow=False, receive_shadow=False,
            wxyz=wxyz(sensor.T_link_sensor), position=sensor.T_link_sensor[:3, 3],
        )  # fmt: skip


def zone_of(snapshot: Snapshot, slot: int, engine: Engine, cell: Cell) -> Zone:
    """The zone in a slot as it is in a snapshot."""
    skin, cloud = engine.skin, snapshot.cloud
    k = int(skin.sensor_of[slot])
    distance = float(distances(cloud, snapshot.T_base_link, skin)[slot])
    age = float(snapshot.stamp - cloud.stamp[k])
    dirty = len(snapshot.unable) > k and snapshot.unable[k] == Unable.DIRTY_WINDOW
    return Zone(cloud, slot, k, distance, age, bool(dirty), skin, engine.robot, cell)


def listen_to_clicks(
    server: viser.ViserServer, engine: Engine, chosen: Chosen, cloud: CloudView,
    coverage: CoverageView,
) -> None:  # fmt: skip
    """Let a click in the scene choose among the points that are drawn, the sensors, and the patches
    of the arm's surface where those are shown."""

    @server.scene.on_click()  # type: ignore[arg-type]  # awaited, whatever its type says
    async def _(event: viser.SceneClickEvent) -> None:
        snapshot, _ = engine.snapshots.get()
        if snapshot is not None:
            ray = np.array(event.ray_origin), np.array(event.ray_direction)
            chosen.click(*ray, snapshot, cloud.shown())
            coverage.click(*ray, snapshot)
